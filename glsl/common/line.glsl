// Numbers of workgroup and invocation in a dispatch of vk::group_line, row by row. The last ones may be beyond the
// work. Needs the workgroup's size.
uint line_group() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
uint line_invocation() { return line_group() * gl_WorkGroupSize.x + gl_LocalInvocationIndex; }
