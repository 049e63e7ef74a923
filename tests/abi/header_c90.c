/* SPDX-License-Identifier: Apache-2.0
 *
 * The plugin's header in plain C90, as an old controller would include it. */
#include "ravencal/control.h"
#include "ravencal/plugin.h"
#include "ravencal/telemetry.h"

int ravencal_header_in_c(void);

int ravencal_header_in_c(void) {
  ravencal_output output;
  output.struct_size = (uint32_t)sizeof(ravencal_output);
  output.state = RAVENCAL_STATE_OFF;
  return (int)(output.struct_size + (uint32_t)output.state);
}
