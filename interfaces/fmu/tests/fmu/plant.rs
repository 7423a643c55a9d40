//! The plant as an FMU, driven with the commands of a run, makes the truth and the samples of that run to the last bit.

use crate::common::{packed, project, simulation};
use libloading::Library;
use monorig_estimators::api::signals::{Command, Shape, Slot};
use monorig_fmu::Fmi;
use monorig_plugin::signals;
use monorig_sim::closed_loop::{Observer, StepFrame};
use monorig_sim::error::Error;
use monorig_sim::record::visit_truth;
use std::collections::BTreeMap;
use std::ffi::{CString, c_char, c_void};
use std::path::{Path, PathBuf};
use std::ptr::null;

type Handle = *mut c_void;

/// A step of a run: command, samples by name, truth by name.
struct Step {
    t_s: f64,
    command: Command,
    outputs: Vec<(String, u64)>,
}

/// Keeps the steps of a run.
#[derive(Default)]
struct Keep(Vec<Step>);

impl Observer for Keep {
    fn wants_truth(&self, _: i64) -> bool {
        true
    }
    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        let mut outputs = Vec::new();
        visit_truth(f.truth, &mut |c| {
            outputs.push((c.path.to_string().replace('/', "."), c.value.to_bits()));
        });
        for slot in Slot::all().filter(|s| s.measurand.shape() != Shape::Auxiliary) {
            if let Some(sample) = slot.get(f.measurements) {
                let names = signals::value_names(slot)
                    .into_iter()
                    .chain([signals::stamp_name(slot)]);
                let count = slot.measurand.shape().values();
                let values = sample.value.into_iter().take(count).chain([sample.t.s()]);
                outputs.extend(names.zip(values.map(f64::to_bits)));
            }
        }
        self.0.push(Step {
            t_s: f.truth.t_s,
            command: *f.command,
            outputs,
        });
        Ok(())
    }
}

/// A small host: an FMU of either standard by the names of its variables.
struct Host {
    fmi: Fmi,
    library: Library,
    handle: Handle,
    references: BTreeMap<String, u32>,
    _folder: tempfile::TempDir,
}

fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    let at = element.find(&format!(" {name}=\""))? + name.len() + 3;
    element[at..].split('"').next()
}

impl Host {
    fn new(fmu: &Path, fmi: Fmi, seed: i32) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut archive = zip::ZipArchive::new(std::fs::File::open(fmu).unwrap()).unwrap();
        archive.extract(folder.path()).unwrap();
        let xml = std::fs::read_to_string(folder.path().join("modelDescription.xml")).unwrap();
        let elements = xml
            .split('<')
            .filter(|e| e.contains("valueReference=") && e.contains(" name="));
        let references: BTreeMap<String, u32> = elements
            .map(|e| {
                let reference = attribute(e, "valueReference").unwrap().parse().unwrap();
                (attribute(e, "name").unwrap().to_owned(), reference)
            })
            .collect();
        let binaries = folder.path().join("binaries");
        let inner = |of: PathBuf| {
            std::fs::read_dir(of)
                .unwrap()
                .next()
                .unwrap()
                .unwrap()
                .path()
        };
        let library = inner(inner(binaries));
        // SAFETY: an FMU of ours.
        let library = unsafe { Library::new(library) }.unwrap();
        let text = |text: &str| CString::new(text).unwrap();
        let token = attribute(
            &xml,
            if fmi == Fmi::Two {
                "guid"
            } else {
                "instantiationToken"
            },
        );
        let (name, token) = (text("plant"), text(token.unwrap()));
        let resources = folder.path().join("resources");
        let handle = match fmi {
            Fmi::Two => {
                type Make = unsafe extern "C" fn(
                    *const c_char,
                    i32,
                    *const c_char,
                    *const c_char,
                    *const c_void,
                    i32,
                    i32,
                ) -> Handle;
                let at = text(&format!("file://{}", resources.display()));
                // SAFETY: the function of FMI 2.0.
                let make = unsafe { library.get::<Make>(b"fmi2Instantiate") }.unwrap();
                // SAFETY: texts, and no callbacks.
                unsafe { make(name.as_ptr(), 1, token.as_ptr(), at.as_ptr(), null(), 0, 0) }
            }
            Fmi::Three => {
                type Make = unsafe extern "C" fn(
                    *const c_char,
                    *const c_char,
                    *const c_char,
                    bool,
                    bool,
                    bool,
                    bool,
                    *const u32,
                    usize,
                    *const c_void,
                    *const c_void,
                    *const c_void,
                ) -> Handle;
                let at = text(&format!("{}/", resources.display()));
                // SAFETY: the function of FMI 3.0.
                let make = unsafe { library.get::<Make>(b"fmi3InstantiateCoSimulation") }.unwrap();
                let (n, t, r) = (name.as_ptr(), token.as_ptr(), at.as_ptr());
                // SAFETY: texts, and no callbacks.
                unsafe {
                    make(
                        n,
                        t,
                        r,
                        false,
                        false,
                        false,
                        false,
                        null(),
                        0,
                        null(),
                        null(),
                        null(),
                    )
                }
            }
        };
        assert!(!handle.is_null());
        let host = Self {
            fmi,
            library,
            handle,
            references,
            _folder: folder,
        };
        host.set_seed(seed);
        let begun = host.plain(match fmi {
            Fmi::Two => b"fmi2ExitInitializationMode",
            Fmi::Three => b"fmi3ExitInitializationMode",
        });
        assert_eq!(begun, 0);
        host
    }

    fn plain(&self, name: &[u8]) -> i32 {
        // SAFETY: a function that takes an instance.
        let f = unsafe {
            self.library
                .get::<unsafe extern "C" fn(Handle) -> i32>(name)
        }
        .unwrap();
        // SAFETY: an instance.
        unsafe { f(self.handle) }
    }

    fn set_seed(&self, seed: i32) {
        type Set = unsafe extern "C" fn(Handle, *const u32, usize, *const i32, usize) -> i32;
        let name: &[u8] = if self.fmi == Fmi::Two {
            b"fmi2SetInteger"
        } else {
            b"fmi3SetInt32"
        };
        // SAFETY: FMI 2.0 looks at all but the last argument.
        let set = unsafe { self.library.get::<Set>(name) }.unwrap();
        let reference = self.references["seed"];
        // SAFETY: one reference and one value.
        let code = unsafe { set(self.handle, &reference, 1, &seed, 1) };
        assert_eq!(code, 0);
    }

    fn set(&self, name: &str, x: f64) -> i32 {
        type Set = unsafe extern "C" fn(Handle, *const u32, usize, *const f64, usize) -> i32;
        let function: &[u8] = if self.fmi == Fmi::Two {
            b"fmi2SetReal"
        } else {
            b"fmi3SetFloat64"
        };
        // SAFETY: FMI 2.0 looks at all but the last argument.
        let set = unsafe { self.library.get::<Set>(function) }.unwrap();
        // SAFETY: one reference and one value.
        unsafe { set(self.handle, &self.references[name], 1, &x, 1) }
    }

    fn get(&self, name: &str) -> f64 {
        type Get = unsafe extern "C" fn(Handle, *const u32, usize, *mut f64, usize) -> i32;
        let function: &[u8] = if self.fmi == Fmi::Two {
            b"fmi2GetReal"
        } else {
            b"fmi3GetFloat64"
        };
        // SAFETY: FMI 2.0 looks at all but the last argument.
        let get = unsafe { self.library.get::<Get>(function) }.unwrap();
        let mut x = 0.0;
        let reference = self.references[name];
        // SAFETY: one reference and one place.
        let code = unsafe { get(self.handle, &reference, 1, &mut x, 1) };
        assert_eq!(code, 0, "{name}");
        x
    }

    fn step(&self, t_s: f64, dt_s: f64) -> i32 {
        if self.fmi == Fmi::Two {
            type Do = unsafe extern "C" fn(Handle, f64, f64, i32) -> i32;
            // SAFETY: the function of FMI 2.0.
            let step = unsafe { self.library.get::<Do>(b"fmi2DoStep") }.unwrap();
            // SAFETY: an instance.
            return unsafe { step(self.handle, t_s, dt_s, 1) };
        }
        type Do = unsafe extern "C" fn(
            Handle,
            f64,
            f64,
            bool,
            *mut bool,
            *mut bool,
            *mut bool,
            *mut f64,
        ) -> i32;
        // SAFETY: the function of FMI 3.0.
        let step = unsafe { self.library.get::<Do>(b"fmi3DoStep") }.unwrap();
        let (mut a, mut b, mut c, mut last_s) = (true, true, true, 0.0);
        // SAFETY: an instance, and places for what it answers.
        let code = unsafe {
            step(
                self.handle,
                t_s,
                dt_s,
                true,
                &mut a,
                &mut b,
                &mut c,
                &mut last_s,
            )
        };
        assert!(!a && !b && !c);
        code
    }

    fn command(&self, u: &Command, drives: usize) {
        for (index, torque) in u.motor_torque_nm.iter().take(drives).enumerate() {
            assert_eq!(self.set(&signals::torque_command(index), *torque), 0);
        }
        assert_eq!(self.set(signals::CLAMP_COMMAND, u.clamp_pressure_mpa), 0);
        assert_eq!(self.set(signals::BRAKE_COMMAND, u.brake), 0);
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.plain(match self.fmi {
            Fmi::Two => b"fmi2FreeInstance",
            Fmi::Three => b"fmi3FreeInstance",
        });
    }
}

/// A train with events and all of its instruments, a car on a road, and a seed that is not the first.
#[test]
fn the_plant_under_recorded_commands_makes_the_recorded_truth() {
    let folder = tempfile::tempdir().unwrap();
    for (file, seconds, seed) in [
        ("guo2024_flat_turning.yaml", 6.0, 1),
        ("minimal.yaml", 6.0, 3),
    ] {
        let mut native = simulation(file, seconds, seed);
        let (drives, dt_s) = (native.vehicle.drives, native.dt_s);
        let mut keep = Keep::default();
        native.run(&mut [&mut keep]).unwrap();
        let told = ("vehicle.exact.all".to_owned(), "a test".to_owned());
        let package = monorig_fmu::plant(&project().join("scenarios").join(file), &[told]).unwrap();
        for fmi in [Fmi::Two, Fmi::Three] {
            let host = Host::new(&packed(&package, fmi, folder.path()), fmi, seed as i32);
            // without a command the clamps press as the scenario has them press
            let clamp = keep.0[0].command.clamp_pressure_mpa;
            assert_eq!(host.get(signals::CLAMP_COMMAND), clamp, "{file}");
            let (mut t_s, mut samples) = (0.0, 0);
            for step in &keep.0 {
                host.command(&step.command, drives);
                assert_eq!(host.step(t_s, dt_s), 0);
                t_s = step.t_s;
                for (name, bits) in &step.outputs {
                    assert_eq!(
                        host.get(name).to_bits(),
                        *bits,
                        "{name} at {t_s} s of {file}"
                    );
                    samples += u32::from(name.starts_with("specific_force"));
                }
            }
            assert!(keep.0.len() > 1000 && samples > 100);
            // steps that cannot be made change nothing, and the next one goes on
            const DISCARD: i32 = 2;
            assert_eq!(host.step(t_s, 0.3 * dt_s), DISCARD);
            assert_eq!(host.step(0.0, dt_s), DISCARD);
            assert_eq!(
                host.get("truth.chainage").to_bits(),
                keep.0.last().unwrap().outputs[0].1
            );
            assert_eq!(host.step(t_s, 5.0 * dt_s), 0);
            assert!(host.set("truth.speed", 1.0) > 1, "an output is not set");
        }
    }
}
