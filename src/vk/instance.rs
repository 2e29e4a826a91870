//! Loader, layers, debug messenger and the list of devices.

use super::features::{Feature, offered};
use super::message::{Message, Messages, messenger_info};
use super::physical::{PhysicalDevice, choose};
use super::{Check, DisplayHandle, Error, Result};
use ash::{ext, khr, vk};
use std::ffi::CStr;
use std::sync::{Arc, Once, OnceLock};

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// An instance that is never destroyed, so that the loader keeps the drivers loaded. Otherwise each [`Instance`] loads
/// and unloads them. Mesa 25.0.7's lavapipe then crashes if several threads open and close devices at the same time: in
/// 7 of 20 runs of a test, and in none with this instance. NVIDIA 580.159 fails after about 30 loads in one process.
static DRIVERS: OnceLock<(ash::Entry, ash::Instance)> = OnceLock::new();

/// The Vulkan instance. Surface extensions are enabled only if there is a window to present to.
pub struct Instance {
    pub(crate) handle: ash::Instance,
    pub(crate) debug: Option<ext::debug_utils::Instance>,
    messenger: vk::DebugUtilsMessengerEXT,
    messages: Arc<Messages>,
    validating: bool,
    pub(crate) entry: ash::Entry,
}

/// Kinds of devices, the preferred first. All others are "other".
const KINDS: [(vk::PhysicalDeviceType, &str); 4] = [
    (vk::PhysicalDeviceType::DISCRETE_GPU, "discrete"),
    (vk::PhysicalDeviceType::INTEGRATED_GPU, "integrated"),
    (vk::PhysicalDeviceType::VIRTUAL_GPU, "virtual"),
    (vk::PhysicalDeviceType::CPU, "cpu"),
];

/// State of the loader and its drivers, for `ortelius doctor`.
#[derive(Clone, Debug)]
pub struct Survey {
    pub loader_api: (u32, u32, u32),
    pub layers: Vec<String>,
    pub devices: Vec<PhysicalDevice>,
}

impl Instance {
    /// Opens the loader. `validate` enables the validation layer with synchronisation validation. Layers and
    /// settings from the environment stay in force.
    ///
    /// # Errors
    /// [`Error::Loader`]; [`Error::NoValidationLayer`]; [`Error::NoDevice`] if no driver loads.
    pub fn new(validate: bool) -> Result<Instance> {
        Instance::presenting(validate, None)
    }

    /// Like [`Instance::new`], and enables presenting to windows of `display`.
    ///
    /// # Errors
    /// As [`Instance::new`]; [`Error::Limit`] if the loader does not support this display.
    pub fn presenting(validate: bool, display: Option<DisplayHandle<'_>>) -> Result<Instance> {
        keep_vector_widths_apart();
        // SAFETY: the loader's initialisers are sound to run; the entry outlives the instance (field order).
        let entry = unsafe { ash::Entry::load() }.map_err(|e| Error::Loader(e.to_string()))?;
        let layers = layer_names(&entry)?;
        if validate && !layers.iter().any(|name| name.as_bytes() == VALIDATION.to_bytes()) {
            return Err(Error::NoValidationLayer);
        }
        // SAFETY: plain enumeration.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
            .check("vkEnumerateInstanceExtensionProperties", "loader")?;
        let has_debug = extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));
        let messages = Arc::new(Messages::default());
        let named = |name: &&CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(*name));
        let surface = display.map_or(Ok(Vec::new()), surface_extensions)?;
        if let Some(missing) = surface.iter().find(|name| !named(name)) {
            let missing = missing.to_string_lossy();
            let what = format!("the Vulkan loader has no {missing}; update it, or render headless");
            return Err(Error::limit("window", what));
        }
        // Without it, the loader hides devices that lack parts of Vulkan, such as MoltenVK's.
        let portability: Vec<_> = [khr::portability_enumeration::NAME].into_iter().filter(named).collect();
        if DRIVERS.get().is_none() {
            let keeps = create(&entry, false, false, &portability, &messages)?;
            if let Err((_, second)) = DRIVERS.set((entry.clone(), keeps)) {
                // SAFETY: another thread stored its instance first; nothing was created from this one.
                unsafe { second.destroy_instance(None) };
            }
        }
        let handle = create(&entry, validate, has_debug, &[surface, portability].concat(), &messages)?;
        let debug = has_debug.then(|| ext::debug_utils::Instance::new(&entry, &handle));
        let messenger = vk::DebugUtilsMessengerEXT::null();
        let mut instance = Instance { handle, debug, messenger, messages, validating: validate, entry };
        if let Some(debug) = &instance.debug {
            let info = messenger_info(&instance.messages);
            // SAFETY: `messages` lives as long as the instance.
            instance.messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }
                .check("vkCreateDebugUtilsMessengerEXT", "instance")?;
        }
        Ok(instance)
    }

    /// Every message so far, except accepted warnings.
    pub fn messages(&self) -> Vec<Message> {
        self.messages.all()
    }

    pub fn validating(&self) -> bool {
        self.validating
    }

    /// All devices: discrete, then integrated, virtual, software. Devices of one kind keep the loader's
    /// order.
    ///
    /// # Errors
    /// [`Error::Call`] if the loader fails.
    pub fn devices(&self) -> Result<Vec<PhysicalDevice>> {
        // SAFETY: plain enumeration on a live instance.
        let handles = unsafe { self.handle.enumerate_physical_devices() }
            .check("vkEnumeratePhysicalDevices", "instance")?;
        let mut devices: Vec<_> =
            handles.into_iter().map(|handle| self.describe(handle)).collect::<Result<_>>()?;
        devices.sort_by_key(|device| {
            KINDS.iter().position(|(_, kind)| *kind == device.kind).unwrap_or(KINDS.len())
        });
        Ok(devices)
    }

    /// The device that `wanted` names (its index in [`Instance::devices`], or part of its name), or else the first
    /// usable one. If `presents`, a device with swapchains is preferred.
    ///
    /// # Errors
    /// [`Error::NoDevice`]; [`Error::DeviceChoice`] with the list of available devices.
    pub fn choose(&self, wanted: Option<&str>, presents: bool) -> Result<PhysicalDevice> {
        let devices = self.devices()?;
        // An empty ORTELIUS_DEVICE counts as unset.
        let wanted = wanted.filter(|wanted| !wanted.is_empty());
        choose(&devices, wanted, presents).cloned().ok_or_else(|| match wanted {
            Some(wanted) => {
                let found = devices.iter().map(|device| device.name.clone()).collect::<Vec<_>>().join(", ");
                Error::DeviceChoice { wanted: wanted.to_string(), found }
            }
            None => Error::NoDevice { searched: searched_folders() },
        })
    }

    fn describe(&self, handle: vk::PhysicalDevice) -> Result<PhysicalDevice> {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut feedback = vk::PhysicalDeviceTransformFeedbackPropertiesEXT::default();
        let mut buffers = vk::PhysicalDeviceMaintenance4Properties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut driver)
            .push_next(&mut feedback)
            .push_next(&mut buffers);
        // SAFETY: the chain lives on this stack frame.
        unsafe { self.handle.get_physical_device_properties2(handle, &mut properties) };
        let core = properties.properties;
        // SAFETY: plain enumeration on a live instance.
        let extensions = unsafe { self.handle.enumerate_device_extension_properties(handle) }
            .check("vkEnumerateDeviceExtensionProperties", "device")?;
        let extensions: Vec<String> = extensions
            .iter()
            .filter_map(|e| Some(e.extension_name_as_c_str().ok()?.to_string_lossy().into_owned()))
            .collect();
        let text = |c: std::result::Result<&CStr, _>| {
            c.map_or(String::new(), |c: &CStr| c.to_string_lossy().into_owned())
        };
        let mut offered = offered(&self.handle, handle, &extensions);
        // Only a transform-feedback query reports that the visible-tile list was too short. Devices without the
        // extension leave the property 0.
        if feedback.transform_feedback_queries == vk::FALSE {
            offered.features.retain(|feature| *feature != Feature::TransformFeedback);
        }
        Ok(PhysicalDevice {
            handle,
            name: text(core.device_name_as_c_str()),
            kind: KINDS.iter().find(|(of, _)| *of == core.device_type).map_or("other", |(_, kind)| *kind),
            driver: format!(
                "{} {}",
                text(driver.driver_name_as_c_str()),
                text(driver.driver_info_as_c_str())
            ),
            api: version(core.api_version),
            features: offered.features.clone(),
            subgroup_size: offered.subgroup_size,
            shared_bytes: core.limits.max_compute_shared_memory_size,
            offered,
            limits: core.limits,
            max_feedback_bytes: feedback.max_transform_feedback_buffer_size,
            max_buffer_bytes: buffers.max_buffer_size,
        })
    }

    /// Collects the data that `ortelius doctor` prints.
    ///
    /// # Errors
    /// [`Error::Loader`] or a failed enumeration.
    pub fn survey() -> Result<Survey> {
        let instance = Instance::new(false)?;
        // SAFETY: plain queries of the loader.
        let api = unsafe { instance.entry.try_enumerate_instance_version() }
            .check("vkEnumerateInstanceVersion", "loader")?
            .unwrap_or(vk::API_VERSION_1_0);
        Ok(Survey {
            loader_api: version(api),
            layers: layer_names(&instance.entry)?,
            devices: instance.devices()?,
        })
    }
}

/// Instance extensions for presenting to a window of `display`.
#[cfg(feature = "window")]
fn surface_extensions(display: DisplayHandle<'_>) -> Result<Vec<&'static CStr>> {
    let names = ash_window::enumerate_required_extensions(display.as_raw());
    let names = names.check("vkEnumerateInstanceExtensionProperties", "window")?;
    // SAFETY: ash-window returns the names of extensions, which are static.
    Ok(names.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect())
}

#[cfg(not(feature = "window"))]
fn surface_extensions(display: DisplayHandle<'_>) -> Result<Vec<&'static CStr>> {
    match *display {}
}

fn create(
    entry: &ash::Entry,
    validate: bool,
    debug: bool,
    more: &[&CStr],
    messages: &Arc<Messages>,
) -> Result<ash::Instance> {
    let app = vk::ApplicationInfo::default()
        .application_name(c"ortelius")
        .engine_name(c"ortelius")
        .api_version(vk::API_VERSION_1_3);
    let layers: Vec<_> = validate.then_some(VALIDATION.as_ptr()).into_iter().collect();
    let flags = match more.contains(&khr::portability_enumeration::NAME) {
        true => vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR,
        false => vk::InstanceCreateFlags::empty(),
    };
    let mut extensions: Vec<_> = more.iter().map(|name| name.as_ptr()).collect();
    if debug {
        extensions.push(ext::debug_utils::NAME.as_ptr());
    }
    if validate {
        extensions.push(ext::validation_features::NAME.as_ptr());
    }
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut messenger = messenger_info(messages);
    let mut info = vk::InstanceCreateInfo::default()
        .flags(flags)
        .application_info(&app)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    if debug {
        info = info.push_next(&mut messenger);
    }
    if validate {
        info = info.push_next(&mut features);
    }
    // SAFETY: every pointer in `info` lives on this stack frame.
    match unsafe { entry.create_instance(&info, None) } {
        Err(vk::Result::ERROR_INCOMPATIBLE_DRIVER) => Err(Error::NoDevice { searched: searched_folders() }),
        other => other.check("vkCreateInstance", "instance"),
    }
}

/// Switches Mesa's shader cache off if the environment sets the vector width. The cache does not distinguish widths,
/// and code for another width writes beyond its buffers.
fn keep_vector_widths_apart() {
    static ONCE: Once = Once::new();
    if std::env::var_os("LP_NATIVE_VECTOR_WIDTH").is_some() {
        // SAFETY: the standard library orders its own accesses. No driver is loaded yet, so no driver's thread reads
        // the environment. Only C code of a program that uses this library could read it at the same time.
        ONCE.call_once(|| unsafe { std::env::set_var("MESA_SHADER_CACHE_DISABLE", "true") });
    }
}

fn layer_names(entry: &ash::Entry) -> Result<Vec<String>> {
    // SAFETY: plain enumeration.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .check("vkEnumerateInstanceLayerProperties", "loader")?;
    Ok(layers
        .iter()
        .filter_map(|l| Some(l.layer_name_as_c_str().ok()?.to_string_lossy().into_owned()))
        .collect())
}

fn version(packed: u32) -> (u32, u32, u32) {
    (vk::api_version_major(packed), vk::api_version_minor(packed), vk::api_version_patch(packed))
}

/// Folders in which the loader searches for drivers (the Vulkan loader's documentation, "Driver discovery" on
/// Linux).
pub fn driver_folders() -> Vec<String> {
    for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        if let Ok(files) = std::env::var(variable) {
            return files.split(':').map(|file| format!("{file} (from {variable})")).collect();
        }
    }
    let variable = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    let home = variable("HOME").unwrap_or_default();
    let config = variable("XDG_CONFIG_HOME").unwrap_or_else(|| format!("{home}/.config"));
    let data = variable("XDG_DATA_HOME").unwrap_or_else(|| format!("{home}/.local/share"));
    let config_dirs = variable("XDG_CONFIG_DIRS").unwrap_or_else(|| "/etc/xdg".into());
    let data_dirs = variable("XDG_DATA_DIRS").unwrap_or_else(|| "/usr/local/share:/usr/share".into());
    let added = variable("VK_ADD_DRIVER_FILES").unwrap_or_default();
    let bases = [config.as_str()].into_iter().chain(config_dirs.split(':')).chain(["/etc", data.as_str()]);
    let mut folders: Vec<String> =
        added.split(':').filter(|file| !file.is_empty()).map(String::from).collect();
    for base in bases.chain(data_dirs.split(':')) {
        let folder = format!("{base}/vulkan/icd.d");
        if !folders.contains(&folder) {
            folders.push(folder);
        }
    }
    folders
}

fn searched_folders() -> String {
    driver_folders().join(", ")
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: every device was destroyed before: each keeps an Arc of the instance.
        unsafe {
            if let Some(debug) = &self.debug {
                debug.destroy_debug_utils_messenger(self.messenger, None);
            }
            self.handle.destroy_instance(None);
        }
    }
}
