/* The logger that FMI 2.0 asks for takes a format and its values, which Rust cannot define: it puts them together and
 * hands on the text. */
#include <stdarg.h>
#include <stdio.h>

typedef struct listener {
  void (*tell)(const struct listener *, const char *);
} listener;

void monorig_fmi2_log(const listener *to, const char *instance, int status, const char *category, const char *format,
                      ...) {
  char text[1024];
  va_list values;
  (void)instance, (void)status, (void)category;
  if (!to || !format) return;
  va_start(values, format);
  vsnprintf(text, sizeof text, format, values);
  va_end(values);
  to->tell(to, text);
}
