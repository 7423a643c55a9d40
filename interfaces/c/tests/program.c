/* Ours in a program of C, with its instance in static memory. Prints the last estimate, bit by bit. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "monorig_estimator.h"

#define NAME "dffrls_aekf_robust"

/* monorig_size says how much an estimator takes */
static union {
  uint8_t bytes[131072];
  long double alignment;
} memory;

static void print(monorig_value v) {
  uint64_t value, sd;
  memcpy(&value, &v.value, sizeof value);
  memcpy(&sd, &v.sd, sizeof sd);
  printf("%016" PRIx64 " %016" PRIx64 " %" PRIu64 "\n", value, sd, v.valid);
}

int main(void) {
  monorig_vehicle vehicle = monorig_vehicle_defaults();
  monorig_setting settings[] = {{.name = "delta", .kind = MONORIG_NUMBER, .number = 0.95}};
  monorig_setting unknown[] = {{.name = "delat", .kind = MONORIG_NUMBER, .number = 0.95}};
  monorig_reason reason = {""};
  monorig_input z = {.size = sizeof z};
  monorig_estimate estimate = {.size = sizeof estimate};
  vehicle.drives = 1, vehicle.tare_kg = 4000.0, vehicle.wheel_radius_m = 0.17, vehicle.gear_ratio = 20.0;
  vehicle.efficiency = 0.9, vehicle.running_resistance = 0.02;
  vehicle.mass_range_kg[0] = 4000.0, vehicle.mass_range_kg[1] = 30000.0;

  if (monorig_abi() != MONORIG_ABI || monorig_size("nothing") != 0) return 1;
  if (monorig_size(NAME) == 0 || monorig_size(NAME) > sizeof memory) {
    fprintf(stderr, "an instance takes %" PRIu64 " bytes\n", monorig_size(NAME));
    return 1;
  }
  if (monorig_create(&memory, NAME, &vehicle, unknown, 1, &reason) != MONORIG_REFUSED || !strstr(reason.text, "delat"))
    return 2;
  if (monorig_create(&memory.bytes[1], NAME, &vehicle, settings, 1, &reason) != MONORIG_REFUSED) return 2;
  if (monorig_create(&memory, NAME, &vehicle, settings, 1, &reason) != MONORIG_OK) {
    fprintf(stderr, "%s\n", reason.text);
    return 3;
  }
  z.steering_angle_rad.t_ns = z.inclination_rad.t_ns = MONORIG_NONE;
  for (int i = 0; i < MONORIG_MAX_AUXILIARY; i++) z.auxiliary[i].t_ns = MONORIG_NONE;
  for (int i = 0; i < MONORIG_MAX_DRIVES; i++)
    z.motor_torque_nm[i].t_ns = z.wheel_speed_mps[i].t_ns = z.clamp_pressure_mpa[i].t_ns = MONORIG_NONE;
  for (int64_t step = 1; step <= 2000; step++) {
    z.t_ns = 5000000 * step;
    z.dt_s = 0.005;
    z.wheel_speed_mps[0] = (monorig_sample){z.t_ns, 0.5 + 0.00001 * (double)step};
    z.motor_torque_nm[0] = (monorig_sample){z.t_ns, 20.0};
    z.specific_force_mps2 = (monorig_sample3){z.t_ns, {0.002, 0.0, 9.81}};
    z.angular_rate_radps = (monorig_sample3){z.t_ns, {0.0, 0.0, 0.0}};
    if (monorig_step(&memory, &z, &estimate, &reason) != MONORIG_OK) {
      fprintf(stderr, "%s\n", reason.text);
      return 4;
    }
  }
  /* the clock does not go back */
  z.t_ns = 0;
  if (monorig_step(&memory, &z, &estimate, &reason) != MONORIG_REFUSED) return 5;
  print(estimate.total_mass_kg);
  print(estimate.grade_rad);
  print(estimate.speed_mps);
  return 0;
}
