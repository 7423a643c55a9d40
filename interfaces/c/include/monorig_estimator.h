/* monorig_estimator.h: an estimator behind a table of C functions, both ways.
 *
 * Yours in monorig: write these functions, build a shared library, and name it in a scenario:
 *     estimators: {mine: {library: ./mine.so, grade_noise: 0.03}}
 * monorig's in your program: link libmonorig_c (.so, .a) and call the same functions.
 *
 * C99 and C++. Nothing here allocates: the caller gives the memory of an instance. SI units; IMU axes: x forward,
 * y left, z up. One thread at a time uses an instance; several threads may use several instances.
 * Structs hold 8-byte numbers and texts only, so their layout is the same for every compiler. A text ends with a zero
 * byte. A flag is 0 or 1. */
#ifndef MONORIG_ESTIMATOR_H
#define MONORIG_ESTIMATOR_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef MONORIG_API
#ifdef _WIN32
#define MONORIG_API __declspec(dllexport)
#else
#define MONORIG_API
#endif
#endif

/* Number of this header. It grows with every change of a struct or of a function. */
#define MONORIG_ABI 1u

#define MONORIG_MAX_DRIVES 16
#define MONORIG_MAX_AUXILIARY 4
#define MONORIG_MAX_MASSES 24
/* Alignment of the memory of an instance, in bytes. */
#define MONORIG_ALIGNMENT 16
/* Stamp of a sample that did not come. */
#define MONORIG_NONE INT64_MIN

/* What a function returns. */
#define MONORIG_OK 0
#define MONORIG_REFUSED 1 /* no such item; or the step is refused */
#define MONORIG_BROKEN 2  /* the instance cannot go on: the run ends */

/* A reason in words, for MONORIG_REFUSED and MONORIG_BROKEN. monorig shows the first 96 bytes of that of a step. */
typedef struct {
  char text[200];
} monorig_reason;

/* A name and the unit of its values, "-" for none. */
typedef struct {
  char name[64];
  char unit[32];
} monorig_label;

/* A measured value, and when it was taken on the sensor's clock, in ns. */
typedef struct {
  int64_t t_ns;
  double value;
} monorig_sample;

typedef struct {
  int64_t t_ns;
  double value[3];
} monorig_sample3;

/* New samples since the last step, and the command that the train has now. */
typedef struct {
  uint64_t size; /* sizeof(monorig_input) */
  int64_t t_ns;  /* now */
  double dt_s;   /* since the last step, s */
  monorig_sample3 specific_force_mps2;
  monorig_sample3 angular_rate_radps;
  monorig_sample steering_angle_rad;
  monorig_sample inclination_rad;
  monorig_sample auxiliary[MONORIG_MAX_AUXILIARY];
  monorig_sample motor_torque_nm[MONORIG_MAX_DRIVES];    /* at the motor shaft, a sample for each drive unit */
  monorig_sample wheel_speed_mps[MONORIG_MAX_DRIVES];    /* at the rim */
  monorig_sample clamp_pressure_mpa[MONORIG_MAX_DRIVES];
  double command_clamp_pressure_mpa;
  double command_brake; /* share of the clamp-brake force, 0 to 1 */
  double command_motor_torque_nm[MONORIG_MAX_DRIVES];
} monorig_input;

/* An estimated quantity; value and standard deviation are finite, also while it is not valid. */
typedef struct {
  double value;
  double sd;
  uint64_t valid;
} monorig_value;

typedef struct {
  uint64_t size; /* sizeof(monorig_estimate) */
  int64_t t_ns;  /* what it is for */
  monorig_value total_mass_kg;
  monorig_value grade_rad;           /* at the IMU, + uphill towards growing chainage */
  monorig_value effective_grade_rad; /* that the train as a whole feels; the same for a point mass */
  monorig_value speed_mps;
  double innovation; /* of the slope filter's last measurement */
  double nis;        /* that squared over its variance */
  uint64_t moving;
  uint64_t excited;
  uint64_t saturated;
  double total_mass_protection_kg; /* protection levels: errors are meant to exceed them no more often than the risk that */
  double grade_protection_rad;     /* the estimator is built for; 0: it has none, monorig takes k standard deviations */
  double effective_grade_protection_rad;
} monorig_estimate;

typedef struct {
  double places_m[2]; /* behind the middle of the unit with the IMU, the foremost first */
  double mass_kg;
  double depth_m;
} monorig_carried_mass;

/* Nominal values of the vehicle. */
typedef struct {
  uint64_t size; /* sizeof(monorig_vehicle) */
  uint64_t drives;
  double tare_kg;
  double wheel_radius_m;
  double gear_ratio;
  double efficiency;
  double rotating_mass_kg;
  double running_resistance; /* over total mass, g and the cosine of the grade */
  double mass_range_kg[2];
  double mass_guess_kg; /* to start from; NaN: not told */
  double tare_span_m[2];
  double load_span_m[2];
  double imu_arm_m;
  double accel_bias_sd_mps2; /* NaN: not known */
  double gyro_bias_sd_radps; /* NaN: not known */
  uint64_t has_layout;       /* 1: the mass layout below is known */
  monorig_carried_mass masses[MONORIG_MAX_MASSES]; /* unused ones have no mass */
  double load_places_m[2];
  double swinging_tare_kg;
  double hook_depth_m;
  double below_chains_m;
  double chain_m;
  double longitudinal_stiffness_npm; /* NaN: rigid */
  double imu_depth_m;
  double load_share_of_resistance;
  uint64_t has_road; /* 1: a road vehicle, with the values below */
  double drag_area_m2;
  double air_density_kgpm3;
  double front_axle_m;
  double rear_axle_m;
  double front_cornering_npr;
  double rear_cornering_npr;
} monorig_vehicle;

/* A vehicle of which nothing is told yet: its size, NaN where that means "not told", and 0. Set the rest, or take that of
   a scenario: `monorig check SCENARIO --vehicle c`. */
static inline monorig_vehicle monorig_vehicle_defaults(void) {
  monorig_vehicle none;
  unsigned char *byte = (unsigned char *)&none, *end = byte + sizeof none;
  double nan = 0.0;
  while (byte < end) *byte++ = 0;
  nan /= nan;
  none.size = sizeof none;
  none.mass_guess_kg = none.accel_bias_sd_mps2 = none.gyro_bias_sd_radps = none.longitudinal_stiffness_npm = nan;
  return none;
}

/* Kinds of a parameter. */
#define MONORIG_NUMBER 0
#define MONORIG_FLAG 1
#define MONORIG_WORD 2

/* A parameter there is. */
typedef struct {
  char name[64];
  char unit[32];
  char doc[512]; /* one sentence */
  uint64_t kind;
  double otherwise; /* value when not set; NaN: the estimator derives one; of a flag 0 or 1 */
  double least;
  double most;
  char words[256]; /* of a word: all there are, with blanks between them; the first is the default */
} monorig_parameter;

/* A parameter that is set. Those that are not set keep their defaults. */
typedef struct {
  char name[64];
  uint64_t kind;
  double number; /* of a flag 0 or 1 */
  char word[64];
} monorig_setting;

/* What became of the last measurement of a source. */
typedef struct {
  double innovation;
  double innovation_variance;
  double test_ratio; /* innovation squared over variance over the gate's threshold */
  uint64_t outcome;  /* 0 stale, 1 fused, 2 deweighted, rejected: 3 gate, 4 slip, 5 stuck, 6 not running,
                        7 not excited, 8 numeric */
} monorig_aid;

/* These must be there. */

/* MONORIG_ABI. */
MONORIG_API uint32_t monorig_abi(void);
/* The estimators there are, by index from 0; MONORIG_REFUSED after the last. */
MONORIG_API int32_t monorig_name_at(uint64_t index, monorig_label *out);
/* Bytes of memory of an instance; 0: there is no such estimator. */
MONORIG_API uint64_t monorig_size(const char *name);
/* Makes an instance in this memory, of monorig_size bytes aligned to MONORIG_ALIGNMENT. */
MONORIG_API int32_t monorig_create(void *memory, const char *name, const monorig_vehicle *vehicle,
                                   const monorig_setting *settings, uint64_t count, monorig_reason *reason);
/* One step. A refused step leaves the instance as it was; one that ends in a number that is not finite is refused too,
   and leaves it as it was made. */
MONORIG_API int32_t monorig_step(void *memory, const monorig_input *input, monorig_estimate *out,
                                 monorig_reason *reason);
/* Back to the state after monorig_create. */
MONORIG_API void monorig_reset(void *memory);

/* These may be there. */

/* Gives back what monorig_create took beside the memory. */
MONORIG_API void monorig_destroy(void *memory);
/* The parameters of an estimator, by index from 0; MONORIG_REFUSED after the last. */
MONORIG_API int32_t monorig_parameter_at(const char *name, uint64_t index, monorig_parameter *out);
/* Internal quantities, for plots. */
MONORIG_API int32_t monorig_internal_at(const void *memory, uint64_t index, monorig_label *out);
MONORIG_API void monorig_internal_values(const void *memory, double *values, uint64_t room);
/* Sources of measurements, and what became of their last ones. */
MONORIG_API int32_t monorig_aid_at(const void *memory, uint64_t index, monorig_label *out);
MONORIG_API void monorig_aid_status(const void *memory, monorig_aid *status, uint64_t room);
/* Writes the state. Returns the bytes it takes, which may be more than there is room for; negative: none is kept. */
MONORIG_API int64_t monorig_snapshot(const void *memory, uint8_t *bytes, uint64_t room);
/* The state of a snapshot. A refused one leaves the instance as it was. */
MONORIG_API int32_t monorig_restore(void *memory, const uint8_t *bytes, uint64_t length, monorig_reason *reason);
/* 1: a process can have one instance at a time (static variables). */
MONORIG_API uint32_t monorig_one_at_a_time(void);

#ifdef __cplusplus
}
#endif
#endif
