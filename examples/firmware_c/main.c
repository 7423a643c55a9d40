/* One of our estimators in a program of C without an operating system: no heap, no printf. The samples are those of a train
 * that starts on a grade of 5°; yours come from your drivers. The same file runs on a PC: `make host`. */
#include <string.h>

#include "monorig_estimator.h"
#include "vehicle.h"

#define STEPS 2000
#define STEP_NS 5000000

void say(const char *text); /* semihosting.c; on a PC below */

static union {
  uint8_t bytes[32768]; /* monorig_size("rail_fusion") bytes are used */
  uint64_t alignment[2];
} memory __attribute__((aligned(MONORIG_ALIGNMENT)));

static monorig_input z;
static monorig_estimate estimate;
static monorig_reason reason;

/* A number to the last bit. */
static void show(const char *name, double x) {
  char hex[18] = {0};
  uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  for (int i = 0; i < 16; i++) hex[i] = "0123456789abcdef"[bits >> (60 - 4 * i) & 15];
  hex[16] = '\n';
  say(name), say(" "), say(hex);
}

/* Samples that did not come. */
static void none(void) {
  z.specific_force_mps2.t_ns = z.angular_rate_radps.t_ns = MONORIG_NONE;
  z.steering_angle_rad.t_ns = z.inclination_rad.t_ns = MONORIG_NONE;
  for (int i = 0; i < MONORIG_MAX_AUXILIARY; i++) z.auxiliary[i].t_ns = MONORIG_NONE;
  for (int i = 0; i < MONORIG_MAX_DRIVES; i++)
    z.motor_torque_nm[i].t_ns = z.wheel_speed_mps[i].t_ns = z.clamp_pressure_mpa[i].t_ns = MONORIG_NONE;
}

int main(void) {
  z.size = sizeof z, estimate.size = sizeof estimate;
  if (monorig_abi() != MONORIG_ABI || monorig_size("rail_fusion") > sizeof memory) return say("too little memory\n"), 1;
  if (monorig_create(&memory, "rail_fusion", &vehicle, NULL, 0, &reason) != MONORIG_OK) return say(reason.text), say("\n"), 1;
  for (int64_t step = 1; step <= STEPS; step++) {
    double t_s = 0.005 * (double)step, accel = t_s < 5.0 ? 0.2 : 0.0, speed = t_s < 5.0 ? 0.2 * t_s : 1.0;
    none();
    z.t_ns = STEP_NS * step, z.dt_s = 0.005;
    z.specific_force_mps2 = (monorig_sample3){z.t_ns, {accel + 0.855, 0.0, 9.773}};
    z.angular_rate_radps = (monorig_sample3){z.t_ns, {0.0, 0.0, 0.0}};
    z.command_clamp_pressure_mpa = 10.0;
    for (uint64_t i = 0; i < vehicle.drives; i++) {
      z.wheel_speed_mps[i] = (monorig_sample){z.t_ns, speed};
      z.motor_torque_nm[i] = (monorig_sample){z.t_ns, 25.0 + 5.0 * accel};
    }
    if (monorig_step(&memory, &z, &estimate, &reason) != MONORIG_OK) return say(reason.text), say("\n"), 1;
  }
  show("total_mass_kg", estimate.total_mass_kg.value), show("sd", estimate.total_mass_kg.sd);
  show("grade_rad", estimate.grade_rad.value), show("sd", estimate.grade_rad.sd);
  show("speed_mps", estimate.speed_mps.value), show("sd", estimate.speed_mps.sd);
  return 0;
}

#ifdef HOST
#include <stdio.h>
void say(const char *text) { fputs(text, stdout); }
#endif
