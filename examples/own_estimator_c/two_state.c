/* An estimator of one's own in C: a Kalman filter of speed and grade on accelerometer and wheels, and the mass by least
 * squares with forgetting. Build it as the Makefile does. */
#include "monorig_estimator.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define G 9.81

typedef struct {
  monorig_vehicle vehicle;
  double grade_noise; /* rad/s^0.5 */
  double v, theta;    /* state: speed, grade */
  double p00, p01, p11;
  double mass, mass_variance;
  double accel; /* the last specific force along the train */
  double slow_accel, slow_force; /* both behind the same low-pass of 0.5 s */
  double steady_theta, steady_m; /* the grade that has not changed for so long a way */
  uint64_t seen; /* a wheel has been heard */
} two_state;

static int32_t refuse(monorig_reason *reason, const char *why) {
  snprintf(reason->text, sizeof reason->text, "%s", why);
  return MONORIG_REFUSED;
}

uint32_t monorig_abi(void) { return MONORIG_ABI; }

int32_t monorig_name_at(uint64_t index, monorig_label *out) {
  if (index > 0) return MONORIG_REFUSED;
  strcpy(out->name, "two_state");
  strcpy(out->unit, "-");
  return MONORIG_OK;
}

uint64_t monorig_size(const char *name) { return strcmp(name, "two_state") ? 0 : sizeof(two_state); }

int32_t monorig_parameter_at(const char *name, uint64_t index, monorig_parameter *out) {
  static const monorig_parameter GRADE_NOISE = {
      .name = "grade_noise", .unit = "rad/s^0.5", .doc = "How fast the grade may change.",
      .kind = MONORIG_NUMBER, .otherwise = 0.02, .least = 1e-6, .most = 1.0};
  (void)name;
  if (index > 0) return MONORIG_REFUSED;
  *out = GRADE_NOISE;
  return MONORIG_OK;
}

void monorig_reset(void *memory) {
  two_state *s = memory;
  s->v = s->theta = s->accel = s->slow_accel = s->slow_force = 0.0;
  s->steady_theta = s->steady_m = 0.0;
  s->p00 = 0.01, s->p01 = 0.0, s->p11 = 0.03;
  double guess = s->vehicle.mass_guess_kg;
  s->mass = isnan(guess) ? 0.5 * (s->vehicle.mass_range_kg[0] + s->vehicle.mass_range_kg[1]) : guess;
  s->mass_variance = 1e8;
  s->seen = 0;
}

int32_t monorig_create(void *memory, const char *name, const monorig_vehicle *vehicle, const monorig_setting *settings,
                       uint64_t count, monorig_reason *reason) {
  two_state *s = memory;
  (void)name;
  if (vehicle->size != sizeof *vehicle) return refuse(reason, "the vehicle is that of another header");
  if (vehicle->has_road) return refuse(reason, "made for a rail, not for a road");
  s->vehicle = *vehicle;
  s->grade_noise = 0.02;
  for (uint64_t i = 0; i < count; i++)
    if (!strcmp(settings[i].name, "grade_noise")) s->grade_noise = settings[i].number;
  monorig_reset(s);
  return MONORIG_OK;
}

int32_t monorig_step(void *memory, const monorig_input *z, monorig_estimate *out, monorig_reason *reason) {
  two_state *s = memory;
  const monorig_vehicle *c = &s->vehicle;
  double force = 0.0, wheels = 0.0, dt = z->dt_s;
  uint64_t torques = 0, speeds = 0;
  if (!(dt > 0.0 && dt < 1.0)) return refuse(reason, "the time step is not in 0 to 1 s");
  for (uint64_t i = 0; i < c->drives; i++) {
    if (z->motor_torque_nm[i].t_ns != MONORIG_NONE) {
      force += z->motor_torque_nm[i].value * c->gear_ratio * c->efficiency / c->wheel_radius_m;
      torques++;
    }
    if (z->wheel_speed_mps[i].t_ns != MONORIG_NONE) {
      wheels += z->wheel_speed_mps[i].value;
      speeds++;
    }
  }
  if (z->specific_force_mps2.t_ns != MONORIG_NONE) s->accel = z->specific_force_mps2.value[0];

  /* v' = f - g sin(theta), the grade a random walk */
  double a = s->accel - G * sin(s->theta), f = -dt * G * cos(s->theta);
  s->v += dt * a;
  s->p00 += 2.0 * f * s->p01 + f * f * s->p11 + 1e-4 * dt;
  s->p01 += f * s->p11;
  s->p11 += s->grade_noise * s->grade_noise * dt;
  out->innovation = out->nis = 0.0;
  if (speeds > 0) {
    double y = wheels / (double)speeds - s->v, innovation = s->p00 + 4e-4 / (double)speeds;
    double k0 = s->p00 / innovation, k1 = s->p01 / innovation;
    s->v += k0 * y;
    s->theta += k1 * y;
    s->p11 -= k1 * s->p01;
    s->p01 *= 1.0 - k0;
    s->p00 *= 1.0 - k0;
    out->innovation = y;
    out->nis = y * y / innovation;
    s->seen = 1;
  }

  /* the grade is that of the whole train once it has not changed over its length */
  double length = fmax(c->tare_span_m[1], c->load_span_m[1]) - fmin(c->tare_span_m[0], c->load_span_m[0]);
  s->steady_m += fabs(s->v) * dt;
  if (fabs(s->theta - s->steady_theta) > 0.015) {
    s->steady_theta = s->theta;
    s->steady_m = 0.0;
  }
  uint64_t steady = s->steady_m > length + 1.0;

  /* force = mass (f + c g) + rotating masses, where f is large against the bias of the accelerometer */
  uint64_t moving = fabs(s->v) > 0.05;
  double share = dt / (0.5 + dt);
  s->slow_accel += share * (s->accel - s->slow_accel);
  if (torques == c->drives) s->slow_force += share * (force - s->slow_force);
  double h = s->slow_accel + G * c->running_resistance;
  uint64_t excited = moving && steady && fabs(h) > 0.8;
  if (excited) {
    double forget = 0.9995, noise = 300.0 + 0.03 * fabs(s->slow_force);
    double k = s->mass_variance * h / (forget * noise * noise + h * s->mass_variance * h);
    s->mass += k * (s->slow_force - c->rotating_mass_kg * (s->slow_accel - G * sin(s->theta)) - h * s->mass);
    s->mass_variance = fmin((s->mass_variance - k * h * s->mass_variance) / forget, 1e8);
  }

  uint64_t mass_valid = sqrt(s->mass_variance) < 0.05 * s->mass;
  out->t_ns = z->t_ns;
  out->total_mass_kg = (monorig_value){s->mass, sqrt(s->mass_variance), mass_valid};
  out->grade_rad = (monorig_value){s->theta, sqrt(fmax(s->p11, 0.0)), s->seen};
  out->effective_grade_rad = (monorig_value){s->theta, out->grade_rad.sd, s->seen && steady};
  out->speed_mps = (monorig_value){s->v, sqrt(fmax(s->p00, 0.0)), s->seen};
  out->moving = moving;
  out->excited = excited;
  out->saturated = 0;
  return MONORIG_OK;
}

int32_t monorig_internal_at(const void *memory, uint64_t index, monorig_label *out) {
  (void)memory;
  if (index > 0) return MONORIG_REFUSED;
  strcpy(out->name, "mass_variance");
  strcpy(out->unit, "kg²");
  return MONORIG_OK;
}

void monorig_internal_values(const void *memory, double *values, uint64_t room) {
  if (room > 0) values[0] = ((const two_state *)memory)->mass_variance;
}
