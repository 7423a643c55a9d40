/* A model of Embedded Coder behind monorig_estimator.h. Its state is in static variables: one instance at a time. */
#include "model.h"
#include "monorig_estimator.h"
#include <string.h>
static const double STEP_S = 0.005; /* of the model */
uint32_t monorig_abi(void) { return MONORIG_ABI; }
uint32_t monorig_one_at_a_time(void) { return 1; }
int32_t monorig_name_at(uint64_t i, monorig_label *out) {
  if (i > 0) return MONORIG_REFUSED;
  strcpy(out->name, "model");
  return MONORIG_OK;
}
uint64_t monorig_size(const char *name) { return strcmp(name, "model") ? 0 : sizeof(double); }
void monorig_reset(void *memory) { *(double *)memory = 0.0, model_initialize(); }
int32_t monorig_create(void *memory, const char *name, const monorig_vehicle *v, const monorig_setting *s, uint64_t n,
                       monorig_reason *why) {
  (void)name, (void)v, (void)s, (void)n, (void)why;
  monorig_reset(memory);
  return MONORIG_OK;
}
int32_t monorig_step(void *memory, const monorig_input *z, monorig_estimate *out, monorig_reason *why) {
  double *rest_s = memory; /* time for which the model has not been stepped yet */
  (void)why;
  if (z->wheel_speed_mps[0].t_ns != MONORIG_NONE) model_U.wheel_speed = z->wheel_speed_mps[0].value;
  if (z->specific_force_mps2.t_ns != MONORIG_NONE) model_U.accel = z->specific_force_mps2.value[0];
  for (*rest_s += z->dt_s; *rest_s > 0.5 * STEP_S; *rest_s -= STEP_S) model_step();
  out->grade_rad = (monorig_value){model_Y.grade, model_Y.grade_sd, 1};
  return MONORIG_OK;
}
