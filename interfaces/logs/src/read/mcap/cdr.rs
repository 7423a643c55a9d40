//! CDR of ROS 2 (XCDR1, little or big endian): the messages that a crane's log has.

/// Reads values one after the other; alignment counts from behind the four bytes of the header.
struct Cursor<'a> {
    data: &'a [u8],
    at: usize,
    big: bool,
}

impl<'a> Cursor<'a> {
    fn new(data: &'a [u8]) -> Option<Self> {
        let kind = *data.get(1)?;
        (kind <= 1).then_some(Self {
            big: kind == 0,
            data: data.get(4..)?,
            at: 0,
        })
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.at = self.at.div_ceil(N) * N;
        let mut bytes: [u8; N] = self
            .data
            .get(self.at..self.at.checked_add(N)?)?
            .try_into()
            .ok()?;
        self.at += N;
        if self.big {
            bytes.reverse();
        }
        Some(bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    fn string(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let text = self.data.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        std::str::from_utf8(text.strip_suffix(&[0]).unwrap_or(text)).ok()
    }

    /// `std_msgs/Header`: its stamp, ns.
    fn header(&mut self) -> Option<i64> {
        let (s, ns) = (self.u32()? as i32, self.u32()?);
        self.string()?;
        Some(i64::from(s) * 1_000_000_000 + i64::from(ns))
    }

    /// The numbers of a sequence, if the data has room for as many as it declares.
    fn numbers(&mut self) -> Option<Vec<f64>> {
        let count = self.u32()? as usize;
        (count <= self.data.len() / 8).then_some(())?;
        (0..count).map(|_| self.f64()).collect()
    }

    fn names(&mut self) -> Option<Vec<String>> {
        let count = self.u32()? as usize;
        (count <= self.data.len() / 4).then_some(())?;
        (0..count)
            .map(|_| self.string().map(str::to_owned))
            .collect()
    }
}

/// A decoded message.
#[derive(Debug, Default)]
pub(super) struct Decoded {
    /// Stamp of its header, ns; none if it has no header.
    pub stamp_ns: Option<i64>,
    /// Columns and values.
    pub values: Vec<(String, f64)>,
}

/// True if messages of this schema are read.
pub(super) fn is_known(schema: &str) -> bool {
    let known = "sensor_msgs/msg/Imu sensor_msgs/msg/JointState std_msgs/msg/Float64 geometry_msgs/msg/TwistStamped \
                 nav_msgs/msg/Odometry";
    known.split(' ').any(|k| k == schema)
}

/// Decodes a message; none if it breaks off.
pub(super) fn decode(schema: &str, data: &[u8]) -> Option<Decoded> {
    let mut c = Cursor::new(data)?;
    let mut m = Decoded::default();
    let vector = |c: &mut Cursor<'_>, name: &str, m: &mut Decoded| -> Option<()> {
        for axis in ["x", "y", "z"] {
            let x = c.f64()?;
            if !name.is_empty() {
                m.values.push((format!("{name}.{axis}"), x));
            }
        }
        Some(())
    };
    match schema {
        "sensor_msgs/msg/Imu" => {
            m.stamp_ns = Some(c.header()?);
            // orientation and its covariance, then rate and acceleration with theirs
            for _ in 0..13 {
                c.f64()?;
            }
            for name in ["angular_velocity", "linear_acceleration"] {
                vector(&mut c, name, &mut m)?;
                for _ in 0..9 {
                    c.f64()?;
                }
            }
        }
        "sensor_msgs/msg/JointState" => {
            m.stamp_ns = Some(c.header()?);
            let names = c.names()?;
            for what in ["position", "velocity", "effort"] {
                for (i, x) in c.numbers()?.into_iter().enumerate() {
                    let joint = names.get(i).cloned().unwrap_or_else(|| i.to_string());
                    m.values.push((format!("{what}.{joint}"), x));
                }
            }
        }
        "std_msgs/msg/Float64" => m.values.push(("data".into(), c.f64()?)),
        "geometry_msgs/msg/TwistStamped" => {
            m.stamp_ns = Some(c.header()?);
            vector(&mut c, "twist.linear", &mut m)?;
            vector(&mut c, "twist.angular", &mut m)?;
        }
        "nav_msgs/msg/Odometry" => {
            m.stamp_ns = Some(c.header()?);
            c.string()?;
            vector(&mut c, "pose.pose.position", &mut m)?;
            // orientation and the covariance of both
            for _ in 0..40 {
                c.f64()?;
            }
            vector(&mut c, "twist.twist.linear", &mut m)?;
            vector(&mut c, "twist.twist.angular", &mut m)?;
        }
        _ => return None,
    }
    Some(m)
}
