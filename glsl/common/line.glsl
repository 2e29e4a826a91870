// Linear indices of the workgroup and of the invocation in a dispatch of vk::group_line. The last indices may exceed
// the amount of work. Include after local_size.
uint line_group() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
uint line_invocation() { return line_group() * gl_WorkGroupSize.x + gl_LocalInvocationIndex; }
