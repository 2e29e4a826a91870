//! Captures with RenderDoc. If RenderDoc started the program, its library is already loaded.

use std::ffi::{c_int, c_void};

/// `eRENDERDOC_API_Version_1_0_0`. Later versions only append functions.
const VERSION: c_int = 1_00_00;

/// The first functions of `RENDERDOC_API_1_0_0` in renderdoc_app.h.
#[repr(C)]
struct Api {
    /// GetAPIVersion to GetCapture.
    others: [*const c_void; 15],
    trigger_capture: Option<unsafe extern "C" fn()>,
}

type GetApi = unsafe extern "C" fn(c_int, *mut *const Api) -> c_int;

/// Asks for a capture of the next frame, from one presentation to the next. False if RenderDoc is not loaded.
#[cfg(unix)]
pub fn capture_next_frame() -> bool {
    // SAFETY: RTLD_NOLOAD loads nothing and runs no code; both names end with a zero.
    let symbol = unsafe {
        let library = libc::dlopen(c"librenderdoc.so".as_ptr(), libc::RTLD_NOW | libc::RTLD_NOLOAD);
        if library.is_null() {
            return false;
        }
        libc::dlsym(library, c"RENDERDOC_GetAPI".as_ptr())
    };
    if symbol.is_null() {
        return false;
    }
    let mut api: *const Api = std::ptr::null();
    // SAFETY: renderdoc_app.h declares the symbol with this type. The table lives as long as the library, which stays
    // loaded.
    let trigger = unsafe {
        let get_api = std::mem::transmute::<*mut c_void, GetApi>(symbol);
        if get_api(VERSION, &mut api) != 1 || api.is_null() {
            return false;
        }
        (*api).trigger_capture
    };
    // SAFETY: the function takes no argument, and may be called at any time.
    trigger.map(|trigger| unsafe { trigger() }).is_some()
}

/// Always false: RenderDoc's library has another name on other systems.
#[cfg(not(unix))]
pub fn capture_next_frame() -> bool {
    false
}
