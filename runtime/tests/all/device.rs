//! Devices: how a choice is read, the rule that picks one, messages with remedies, and devices that fail.

use tensormass_runtime::device::{
    DeviceChoice, DeviceError, DeviceFeatures, DeviceInfo, DeviceKind, DeviceLimits, select,
};

fn device(kind: DeviceKind, name: &str) -> DeviceInfo {
    DeviceInfo {
        name: name.to_owned(),
        kind,
        backend: "vulkan".to_owned(),
        driver: "driver".to_owned(),
        driver_info: "1.0".to_owned(),
        limits: DeviceLimits {
            storage_buffers_per_stage: 8,
            invocations_per_workgroup: 256,
            workgroup_bytes: 16 << 10,
            storage_binding_bytes: 128 << 20,
            buffer_bytes: 256 << 20,
            workgroups_per_dimension: 65_535,
        },
        features: DeviceFeatures {
            shader_f64: false,
            subgroup: true,
            shader_float32_atomic: false,
            timestamp_query: true,
        },
        unusable: None,
    }
}

fn unusable(mut device: DeviceInfo) -> DeviceInfo {
    device.unusable = Some("max_storage_buffers_per_shader_stage is 4, needed is 8".to_owned());
    device
}

fn choice(text: &str) -> DeviceChoice {
    text.parse().unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn choices_are_read_and_written() {
    let cases = [
        ("auto", DeviceChoice::Auto),
        ("cpu", DeviceChoice::Cpu),
        ("gpu", DeviceChoice::Gpu),
        ("gpu:H200", DeviceChoice::Named("H200".to_owned())),
        ("gpu:llvmpipe (LLVM 15.0.6, 256 bits)", DeviceChoice::Named("llvmpipe (LLVM 15.0.6, 256 bits)".to_owned())),
    ];
    for (text, expected) in cases {
        assert_eq!(choice(text), expected, "{text}");
        assert_eq!(expected.to_string(), text);
    }
    for text in ["", "GPU", "gpu:", "gpu: ", "gpu1", "cuda", "cpu:0"] {
        let error = text.parse::<DeviceChoice>().expect_err(text).to_string();
        assert!(error.starts_with(&format!("`{text}` is not a device; choose auto, cpu, gpu, or gpu:NAME")), "{error}");
    }
    assert_eq!(DeviceChoice::default(), DeviceChoice::Auto);
}

/// A rule, and the name of the device that it picks; none is the CPU.
fn check(choice_text: &str, devices: &[DeviceInfo], expected: Option<&str>) {
    let picked = select(&choice(choice_text), devices).unwrap_or_else(|e| panic!("{choice_text}: {e}"));
    assert_eq!(picked.map(|place| devices[place].name.as_str()), expected, "{choice_text} of {devices:#?}");
}

#[test]
fn auto_takes_hardware_or_the_cpu_and_gpu_takes_what_there_is() {
    let discrete = device(DeviceKind::Discrete, "Big 200");
    let integrated = device(DeviceKind::Integrated, "Small 5");
    let passed_on = device(DeviceKind::Virtual, "Shared");
    let other = device(DeviceKind::Other, "Odd");
    let software = device(DeviceKind::Software, "llvmpipe");
    let alone = [software.clone()];
    for devices in [&[][..], &alone] {
        check("auto", devices, None);
        check("cpu", devices, None);
    }
    check("gpu", &alone, Some("llvmpipe"));
    // Each is preferred to those after it, wherever it stands.
    let kinds = [&discrete, &integrated, &passed_on, &other, &software].map(DeviceInfo::clone);
    for first in 0..kinds.len() {
        let mut devices = kinds[first..].to_vec();
        for _ in 0..2 {
            check("gpu", &devices, Some(&kinds[first].name));
            devices.reverse();
        }
    }
    for hardware in [discrete.clone(), integrated.clone(), passed_on, other] {
        let devices = [hardware.clone(), software.clone()];
        check("auto", &devices, Some(&hardware.name));
        check("gpu", &devices, Some(&hardware.name));
        check("cpu", &devices, None);
    }
    let devices = [unusable(discrete), integrated.clone(), software.clone()];
    check("auto", &devices, Some("Small 5"));
    check("gpu", &devices, Some("Small 5"));
    let devices = [unusable(integrated), software];
    check("auto", &devices, None);
    check("gpu", &devices, Some("llvmpipe"));
}

#[test]
fn a_name_is_equal_or_contained_in_whatever_case() {
    let devices = [
        device(DeviceKind::Discrete, "Big 200 Ti"),
        device(DeviceKind::Discrete, "Big 200"),
        device(DeviceKind::Software, "llvmpipe (LLVM 15.0.6, 256 bits)"),
    ];
    check("gpu:big 200", &devices, Some("Big 200"));
    check("gpu:big 200 t", &devices, Some("Big 200 Ti"));
    // Several contain it: the first of the list.
    check("gpu:Big", &devices, Some("Big 200 Ti"));
    check("gpu:LLVMPIPE", &devices, Some("llvmpipe (LLVM 15.0.6, 256 bits)"));
    let [first, second, _] = devices;
    check("gpu:big", &[unusable(first), second], Some("Big 200"));
}

#[test]
fn what_cannot_be_chosen_is_named_with_a_reason() {
    let software = device(DeviceKind::Software, "llvmpipe (LLVM 15.0.6, 256 bits)");
    let reason = |choice_text: &str, devices: &[DeviceInfo]| {
        select(&choice(choice_text), devices).expect_err(choice_text).to_string()
    };
    let none = "no GPU can be used: there is none\n  = help: install a Vulkan driver (Debian: mesa-vulkan-drivers), or \
                choose --device cpu";
    assert_eq!(reason("gpu", &[]), none);
    assert_eq!(reason("gpu:llvmpipe", &[]), none);
    let alone = [software.clone()];
    let small = [unusable(software)];
    for choice_text in ["gpu", "gpu:llvmpipe"] {
        let message = reason(choice_text, &small);
        let expected = "no GPU can be used: `llvmpipe (LLVM 15.0.6, 256 bits)` cannot be used, \
                        max_storage_buffers_per_shader_stage is 4, needed is 8\n";
        assert!(message.starts_with(expected), "{message}");
    }
    assert_eq!(
        reason("gpu:lvmpype", &alone),
        "no GPU is named `lvmpype`\n  = help: did you mean gpu:llvmpipe? available: `llvmpipe (LLVM 15.0.6, 256 bits)`"
    );
    assert_eq!(
        reason("gpu:H200", &alone),
        "no GPU is named `H200`\n  = help: available: `llvmpipe (LLVM 15.0.6, 256 bits)`"
    );
}

#[test]
fn every_message_says_what_to_do() {
    let text = || "text".to_owned();
    let errors = [
        (DeviceError::NoAdapter { reason: text() }, "mesa-vulkan-drivers"),
        (DeviceError::UnknownName { asked: text(), available: vec!["name".to_owned()] }, "available: `name`"),
        (DeviceError::NoGpuSupport, "--device cpu"),
        (DeviceError::Precision, "--precision f32, or --device cpu"),
        (DeviceError::TooLarge { what: text(), bytes: 300 << 20, limit: 128 << 20 }, "coarser mesh"),
        (DeviceError::OutOfMemory { what: text() }, "--device cpu"),
        (DeviceError::Lost { reason: text() }, "run again, or choose --device cpu"),
        (DeviceError::Refused(text()), "please report it"),
    ];
    for (error, remedy) in errors {
        let message = error.to_string();
        let (_, help) = message.split_once("\n  = help: ").unwrap_or_else(|| panic!("no remedy: {message}"));
        assert!(help.contains(remedy), "{message}");
    }
}

#[cfg(feature = "gpu")]
mod on_a_device {
    use tensormass_runtime::device::{DeviceError, DeviceKind};
    use tensormass_runtime::gpu::{Gpu, adapters};

    use crate::support::gpu::{demands, test_device};

    /// Submits a copy between two new buffers of this many bytes.
    fn copy(gpu: &Gpu, bytes: u64) {
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("test"),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        let (from, to) = (buffer(wgpu::BufferUsages::COPY_SRC), buffer(wgpu::BufferUsages::COPY_DST));
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&from, 0, &to, 0, bytes);
        gpu.queue.submit([encoder.finish()]);
    }

    #[test]
    fn software_devices_come_last() {
        let kinds: Vec<DeviceKind> = adapters().iter().map(|d| d.kind).collect();
        assert!(kinds.is_sorted(), "{kinds:?}");
    }

    #[test]
    fn a_device_holds_at_least_what_webgpu_guarantees_and_works() {
        let Some(gpu) = test_device() else { return };
        let (limits, offered) = (gpu.limits(), &gpu.info().limits);
        assert_eq!(limits.storage_buffers_per_stage, 8);
        assert_eq!(limits.invocations_per_workgroup, 256);
        assert!(limits.storage_binding_bytes >= 128 << 20 && limits.buffer_bytes >= 256 << 20, "{limits:?}");
        // As large as is offered, rounded down.
        assert!(offered.storage_binding_bytes - limits.storage_binding_bytes < 256, "{limits:?} {offered:?}");
        assert!(offered.buffer_bytes - limits.buffer_bytes < 256, "{limits:?} {offered:?}");
        assert_eq!(gpu.is_software(), gpu.info().kind == DeviceKind::Software);
        copy(&gpu, 256);
        assert_eq!(gpu.wait(), Ok(()));
    }

    #[test]
    fn a_lost_device_is_an_error_and_no_panic() {
        let Some(gpu) = test_device() else { return };
        copy(&gpu, 256);
        gpu.destroy();
        // Work that was under way, and work that comes too late.
        copy(&gpu, 256);
        let lost = DeviceError::Lost { reason: "it was closed".to_owned() };
        assert_eq!(gpu.wait(), Err(lost.clone()));
        assert_eq!(gpu.check(), Err(lost.clone()));
        copy(&gpu, 256);
        assert_eq!(gpu.wait(), Err(lost));
    }

    #[test]
    fn a_refused_call_is_an_error_and_no_panic() {
        let Some(gpu) = test_device() else { return };
        // Copies are of whole words.
        copy(&gpu, 255);
        let Err(DeviceError::Refused(reason)) = gpu.check() else { panic!("{:?}", gpu.check()) };
        assert!(reason.contains("255"), "{reason}");
        copy(&gpu, 256);
        // The first refusal stays.
        assert_eq!(gpu.wait(), Err(DeviceError::Refused(reason)));
    }

    #[test]
    fn a_buffer_beyond_the_limit_is_an_error_and_no_panic() {
        let Some(gpu) = test_device() else { return };
        let size = gpu.limits().buffer_bytes + 256;
        let usage = wgpu::BufferUsages::STORAGE;
        let descriptor = wgpu::BufferDescriptor { label: Some("too large"), size, usage, mapped_at_creation: false };
        let _buffer = gpu.device.create_buffer(&descriptor);
        let message = gpu.check().expect_err("a buffer above the limit").to_string();
        assert!(message.contains("too large"), "{message}");
    }

    #[test]
    fn only_a_value_requires_an_adapter() {
        for (value, expected) in [("", false), ("0", false), (" ", false), ("1", true), ("yes", true)] {
            assert_eq!(demands(value), expected, "{value:?}");
        }
    }
}
