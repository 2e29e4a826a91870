//! A Vulkan layer that makes one call fail, or hides features of the device. It is not part of the crate: `main.rs`
//! compiles it with rustc, and the loader loads it. For each kind of fault, only the calls that may return it are
//! counted. Environment variables:
//!
//! - ORTELIUS_FAULT=KIND:N fails the N-th call (from 1) with KIND: `host` or `device` (out of memory), `lost` or
//!   `surface` (lost). A lost device stays lost, a lost surface until the next is created. N = 0 fails none.
//!   KIND:NAME:N fails the N-th call of that name, KIND:NAME the first.
//! - ORTELIUS_FAULT_LOG=FILE: receives the name of the failed call; with N = 0 the names of all calls that may fail.
//! - ORTELIUS_FAULT_START=FILE: calls are counted only while the file exists.
//! - ORTELIUS_MASK=NAME,NAME: features of [`MASKS`] that the device does not report.
//!
//! Only functions that return a VkResult are wrapped. Their arguments are at most eight integers and pointers. The C
//! calling conventions of x86-64 and AArch64 pass each in one word, so one wrapper with room for ten words serves all.

use std::ffi::{CStr, c_char, c_void};
use std::fs::File;
use std::io::Write;
use std::mem::transmute;
use std::path::PathBuf;
use std::sync::{OnceLock, RwLock};
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU64, Ordering::SeqCst};

type Words =
    unsafe extern "C" fn(usize, usize, usize, usize, usize, usize, usize, usize, usize, usize) -> i32;
type GetProc = unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void;

const NOT_INITIALISED: i32 = -3;
const LOST: i32 = -4;
const SURFACE_LOST: i32 = -1_000_000_000;

struct Fault {
    result: i32,
    number: u64,
    name: Option<String>,
    log: Option<File>,
    start: Option<PathBuf>,
}

fn fault() -> &'static Fault {
    static FAULT: OnceLock<Fault> = OnceLock::new();
    FAULT.get_or_init(|| {
        let text = std::env::var("ORTELIUS_FAULT").expect("ORTELIUS_FAULT");
        let (kind, call) = text.split_once(':').expect("KIND:N");
        let result = match kind {
            "host" => -1,
            "device" => -2,
            "lost" => LOST,
            "surface" => SURFACE_LOST,
            other => panic!("ORTELIUS_FAULT: {other}"),
        };
        let log = std::env::var_os("ORTELIUS_FAULT_LOG")
            .map(|path| File::options().append(true).create(true).open(path).expect("the log"));
        let (name, number) = match call.parse() {
            Ok(number) => (None, number),
            Err(_) => {
                let (name, number) = call.split_once(':').unwrap_or((call, "1"));
                (Some(name.to_owned()), number.parse().expect("KIND:NAME:N"))
            }
        };
        let start = std::env::var_os("ORTELIUS_FAULT_START").map(PathBuf::from);
        Fault { result, number, name, log, start }
    })
}

/// True if this call may report that the device, or the surface, is lost.
fn may_report(lost: i32, name: &str) -> bool {
    let of_window = matches!(name, "vkAcquireNextImageKHR" | "vkQueuePresentKHR");
    match lost {
        SURFACE_LOST => of_window || name == "vkGetPhysicalDeviceSurfaceCapabilitiesKHR",
        _ => {
            let of_device = matches!(
                name,
                "vkCreateDevice"
                    | "vkQueueSubmit2"
                    | "vkQueueWaitIdle"
                    | "vkDeviceWaitIdle"
                    | "vkWaitSemaphores"
                    | "vkGetSemaphoreCounterValue"
                    | "vkGetQueryPoolResults"
            );
            of_window || of_device
        }
    }
}

/// The VkResult with which this call must fail.
fn fails(name: &str) -> Option<i32> {
    static CALLS: AtomicU64 = AtomicU64::new(0);
    static IS_LOST: AtomicBool = AtomicBool::new(false);
    let fault = fault();
    if fault.start.as_ref().is_some_and(|start| !start.exists()) {
        return None;
    }
    let loses = matches!(fault.result, LOST | SURFACE_LOST);
    if loses {
        if fault.result == SURFACE_LOST && name.starts_with("vkCreateX") {
            IS_LOST.store(false, SeqCst);
        }
        if !may_report(fault.result, name) {
            return None;
        }
        if IS_LOST.load(SeqCst) {
            return Some(fault.result);
        }
    }
    if fault.name.as_ref().is_some_and(|wanted| wanted != name) {
        return None;
    }
    let is_it = CALLS.fetch_add(1, SeqCst) + 1 == fault.number;
    if let Some(mut log) = fault.log.as_ref()
        && (is_it || fault.number == 0)
    {
        writeln!(log, "{name}").expect("the log");
    }
    IS_LOST.fetch_or(is_it && loses, SeqCst);
    is_it.then_some(fault.result)
}

macro_rules! wrapped {
    ($table:ident: $($name:ident)*) => {
        $(mod $name {
            use super::*;
            pub static NEXT: AtomicPtr<c_void> = AtomicPtr::new(std::ptr::null_mut());
            pub unsafe extern "C" fn call(
                a: usize, b: usize, c: usize, d: usize, e: usize,
                f: usize, g: usize, h: usize, i: usize, j: usize,
            ) -> i32 {
                let failure = fails(stringify!($name));
                // The driver's device is not really lost and keeps working: objects must not be destroyed before it is
                // idle.
                if let Some(result) = failure && !stringify!($name).ends_with("WaitIdle") {
                    return result;
                }
                // SAFETY: the next layer's function of this name; see above for its arguments.
                let result =
                    unsafe { transmute::<*mut c_void, Words>(NEXT.load(SeqCst))(a, b, c, d, e, f, g, h, i, j) };
                failure.unwrap_or(result)
            }
        })*
        static $table: &[(&str, &AtomicPtr<c_void>, Words)] =
            &[$((stringify!($name), &$name::NEXT, $name::call as Words)),*];
    };
}

#[allow(non_snake_case)]
mod wrappers {
    use super::*;
    wrapped!(OF_INSTANCE: vkEnumeratePhysicalDevices vkEnumerateDeviceExtensionProperties
        vkGetPhysicalDeviceImageFormatProperties vkCreateDebugUtilsMessengerEXT vkCreateXcbSurfaceKHR
        vkCreateXlibSurfaceKHR vkGetPhysicalDeviceSurfaceCapabilitiesKHR);
    wrapped!(OF_DEVICE: vkAllocateMemory vkMapMemory vkBindBufferMemory vkBindImageMemory vkCreateBuffer
        vkCreateBufferView vkCreateImage vkCreateImageView vkCreateSampler vkCreateShaderModule
        vkCreatePipelineLayout vkCreateGraphicsPipelines vkCreateComputePipelines
        vkCreateDescriptorSetLayout vkCreateDescriptorPool vkAllocateDescriptorSets vkResetDescriptorPool
        vkCreateQueryPool vkGetQueryPoolResults vkCreateSemaphore vkCreateFence vkWaitForFences vkWaitSemaphores
        vkGetSemaphoreCounterValue vkCreateCommandPool vkResetCommandPool vkAllocateCommandBuffers
        vkBeginCommandBuffer vkEndCommandBuffer vkQueueSubmit2 vkQueueWaitIdle vkDeviceWaitIdle
        vkFlushMappedMemoryRanges vkInvalidateMappedMemoryRanges vkSetDebugUtilsObjectNameEXT
        vkAcquireNextImageKHR vkQueuePresentKHR);

    /// The wrapper of a function that the next layer has.
    pub fn wrapper(of_device: bool, name: &str, next: *mut c_void) -> Option<*mut c_void> {
        let table = if of_device { OF_DEVICE } else { OF_INSTANCE };
        let (_, slot, wrapper) = table.iter().find(|(known, ..)| *known == name)?;
        slot.store(next, SeqCst);
        Some(*wrapper as *mut c_void)
    }
}

/// VkPhysicalDeviceFeatures2, or another structure of its chain.
#[repr(C)]
struct Features {
    kind: i32,
    next: *mut Features,
    first: u32,
}

/// A feature, the structure that has it, and its index there.
const MASKS: [(&str, i32, usize); 3] =
    [("geometryShader", 1_000_059_000, 4), ("logicOp", 1_000_059_000, 8), ("transformFeedback", 1_000_028_000, 0)];

static NEXT_FEATURES: AtomicPtr<c_void> = AtomicPtr::new(std::ptr::null_mut());

unsafe extern "C" fn get_features(physical: *mut c_void, features: *mut Features) {
    let masked = std::env::var("ORTELIUS_MASK").unwrap_or_default();
    // SAFETY: the next layer's function of this type; the structures of the chain have the words of `MASKS`.
    unsafe {
        let next: unsafe extern "C" fn(*mut c_void, *mut Features) = transmute(NEXT_FEATURES.load(SeqCst));
        next(physical, features);
        let mut at = features;
        while !at.is_null() {
            for (name, kind, index) in MASKS {
                if (*at).kind == kind && masked.split(',').any(|masked| masked == name) {
                    (&raw mut (*at).first).add(index).write(0);
                }
            }
            at = (*at).next;
        }
    }
}

/// VkLayerInstanceCreateInfo and VkLayerDeviceCreateInfo.
#[repr(C)]
struct Link {
    kind: i32,
    next: *mut Link,
    function: i32,
    chain: *mut Chain,
}

/// VkLayerInstanceLink and VkLayerDeviceLink. In the latter, the second function is the device's.
#[repr(C)]
struct Chain {
    next: *mut Chain,
    of_instance: GetProc,
    of_device: GetProc,
}

const INSTANCE_LINK: i32 = 47;
const DEVICE_LINK: i32 = 48;

static INSTANCE: AtomicPtr<c_void> = AtomicPtr::new(std::ptr::null_mut());
/// The next layer's functions for the last instance and device. They can change: a second instance may have the
/// validation layer.
static NEXT_OF_INSTANCE: RwLock<Option<GetProc>> = RwLock::new(None);
static NEXT_OF_DEVICE: RwLock<Option<GetProc>> = RwLock::new(None);

/// The loader's link of that kind in a create info, advanced for the next layer.
unsafe fn link(info: *const Link, kind: i32) -> Option<(GetProc, GetProc)> {
    // SAFETY: every structure of a pNext chain begins with its kind and a pointer to the next one.
    unsafe {
        let mut at = (*info).next;
        while let Some(structure) = at.as_mut() {
            if structure.kind == kind && structure.function == 0 {
                let chain = &*structure.chain;
                structure.chain = chain.next;
                return Some((chain.of_instance, chain.of_device));
            }
            at = structure.next;
        }
    }
    None
}

unsafe extern "C" fn create_instance(
    info: *const Link,
    allocator: *const c_void,
    instance: *mut *mut c_void,
) -> i32 {
    if let Some(result) = fails("vkCreateInstance") {
        return result;
    }
    // SAFETY: as Vulkan's loader calls it.
    unsafe {
        let Some((of_instance, _)) = link(info, INSTANCE_LINK) else { return NOT_INITIALISED };
        let next = of_instance(std::ptr::null_mut(), c"vkCreateInstance".as_ptr());
        let next: unsafe extern "C" fn(*const Link, *const c_void, *mut *mut c_void) -> i32 = transmute(next);
        let result = next(info, allocator, instance);
        if result == 0 {
            *NEXT_OF_INSTANCE.write().expect("lock") = Some(of_instance);
            INSTANCE.store(*instance, SeqCst);
        }
        result
    }
}

unsafe extern "C" fn create_device(
    physical: *mut c_void,
    info: *const Link,
    allocator: *const c_void,
    device: *mut *mut c_void,
) -> i32 {
    if let Some(result) = fails("vkCreateDevice") {
        return result;
    }
    // SAFETY: as Vulkan's loader calls it.
    unsafe {
        let Some((of_instance, of_device)) = link(info, DEVICE_LINK) else { return NOT_INITIALISED };
        *NEXT_OF_DEVICE.write().expect("lock") = Some(of_device);
        let next = of_instance(INSTANCE.load(SeqCst), c"vkCreateDevice".as_ptr());
        let next: unsafe extern "C" fn(*mut c_void, *const Link, *const c_void, *mut *mut c_void) -> i32 =
            transmute(next);
        next(physical, info, allocator, device)
    }
}

unsafe extern "C" fn get_instance_proc(instance: *mut c_void, name: *const c_char) -> *mut c_void {
    // SAFETY: the loader's string; the next layer's function.
    unsafe {
        match CStr::from_ptr(name).to_str() {
            Ok("vkGetInstanceProcAddr") => return get_instance_proc as *mut c_void,
            Ok("vkGetDeviceProcAddr") => return get_device_proc as *mut c_void,
            Ok("vkCreateInstance") => return create_instance as *mut c_void,
            Ok("vkCreateDevice") => return create_device as *mut c_void,
            _ => {}
        }
        let Some(next) = *NEXT_OF_INSTANCE.read().expect("lock") else { return std::ptr::null_mut() };
        if CStr::from_ptr(name) == c"vkGetPhysicalDeviceFeatures2" {
            NEXT_FEATURES.store(next(instance, name), SeqCst);
            return get_features as *mut c_void;
        }
        wrap(false, name, next(instance, name))
    }
}

unsafe extern "C" fn get_device_proc(device: *mut c_void, name: *const c_char) -> *mut c_void {
    // SAFETY: as above.
    unsafe {
        if CStr::from_ptr(name) == c"vkGetDeviceProcAddr" {
            return get_device_proc as *mut c_void;
        }
        let Some(next) = *NEXT_OF_DEVICE.read().expect("lock") else { return std::ptr::null_mut() };
        wrap(true, name, next(device, name))
    }
}

unsafe fn wrap(of_device: bool, name: *const c_char, next: *mut c_void) -> *mut c_void {
    // SAFETY: the loader's string.
    let name = unsafe { CStr::from_ptr(name) }.to_str().unwrap_or("");
    if next.is_null() { next } else { wrappers::wrapper(of_device, name, next).unwrap_or(next) }
}

/// VkNegotiateLayerInterface.
#[repr(C)]
pub struct Negotiated {
    kind: i32,
    next: *mut c_void,
    version: u32,
    of_instance: Option<GetProc>,
    of_device: Option<GetProc>,
    of_physical_device: Option<GetProc>,
}

/// The loader's entry.
///
/// # Safety
/// `negotiated` is the loader's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vkNegotiateLoaderLayerInterfaceVersion(negotiated: *mut Negotiated) -> i32 {
    // SAFETY: as stated.
    let negotiated = unsafe { &mut *negotiated };
    negotiated.version = negotiated.version.min(2);
    negotiated.of_instance = Some(get_instance_proc);
    negotiated.of_device = Some(get_device_proc);
    negotiated.of_physical_device = None;
    0
}
