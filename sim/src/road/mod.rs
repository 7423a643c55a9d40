//! A car on a road: the plant for experiments on road vehicles, behind the same [`Plant`](crate::plant::Plant) as the
//! train.
//!
//! Four wheels on a planar body that follows the road's surface. Along the track the surface has the track's grade,
//! across it is level. The models of the estimators are a point mass, or a single track with linear tyres; this is more
//! than either.
//!
//! | file | what it holds |
//! |---|---|
//! | `surface` | the road under the car: grade, pitch of the chord between the axles, curvatures |
//! | `loads` | the body leans on its springs and shifts load between the wheels |
//! | `tyre` | brush tyre with combined slip, friction ellipse and relaxation length |
//! | `wheel` | spin of a wheel under motor, brake, rolling resistance and tyre |
//! | `driver` | steers along the middle of the lane |
//! | `body` | the equations of motion, put together |
//! | `plant` | the [`Plant`](crate::plant::Plant): commands in, truth out |
//! | `car_file` | the file of a car: its data sheet |
//! | `car` | constants of the equations of motion and nominal vehicle that follow from it |
//! | `shapes` | its visible shapes |

pub(crate) mod body;
pub(crate) mod car;
pub(crate) mod car_file;
pub(crate) mod driver;
pub(crate) mod loads;
pub(crate) mod plant;
mod shapes;
pub(crate) mod surface;
pub(crate) mod tyre;
pub(crate) mod wheel;

pub use car::Car;
pub use car_file::CarFile;
pub use plant::RoadPlant;
