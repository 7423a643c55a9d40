//! The faults of a map, put on the channels that they name.

use super::channel::{Channel, Target};
use super::faults::ChannelFaults;
use crate::map::{FaultedChannel, LogFault, Map};
use monorig_estimators::api::signals::Measurand;
use monorig_sim::error::Error;

/// Puts the faults of a map on its channels.
pub(super) fn add(map: &Map, channels: &mut [Channel]) -> Result<(), Error> {
    for (i, fault) in map.file.faults.iter().enumerate() {
        let key = format!("faults[{i}]");
        let mut found = false;
        for channel in channels.iter_mut().filter(|c| hits(fault, c.target)) {
            found = true;
            let name = stream_name(channel.target);
            let faults = channel
                .faults
                .get_or_insert_with(|| ChannelFaults::new(&name));
            faults.push(map, &key, fault)?;
        }
        if !found {
            return Err(map.error(
                format!("{key}.channel"),
                "the map does not have the channel of this fault",
                "use a channel of the map, and an index below the number of its columns",
            ));
        }
    }
    Ok(())
}

/// True if a fault is one of this channel.
fn hits(fault: &LogFault, target: Target) -> bool {
    let (measurand, index) = match target {
        Target::Measured(slot) => (slot.measurand, slot.index),
        Target::Force | Target::Power => (Measurand::MotorTorque, 0),
        Target::CommandTorque(_) | Target::CommandClamp | Target::CommandBrake => return false,
    };
    let is_hit = match fault.channel {
        FaultedChannel::Imu => {
            matches!(measurand, Measurand::SpecificForce | Measurand::AngularRate)
        }
        FaultedChannel::Traction => measurand == Measurand::MotorTorque,
        FaultedChannel::Measured(wanted) => measurand == wanted,
    };
    is_hit && fault.index.is_none_or(|wanted| wanted == index)
}

/// Name of the random stream of a channel's faults. Another name would be other draws.
fn stream_name(target: Target) -> String {
    let Target::Measured(slot) = target else {
        return format!("{target:?}");
    };
    let name = match slot.measurand {
        Measurand::WheelSpeed => "Wheel".to_owned(),
        Measurand::MotorTorque => "Torque".to_owned(),
        Measurand::ClampPressure => "Clamp".to_owned(),
        Measurand::SteeringAngle => "Steering".to_owned(),
        measurand => format!("{measurand:?}"),
    };
    match slot.measurand.shape().slots() {
        1 => name,
        _ => format!("{name}({})", slot.index),
    }
}
