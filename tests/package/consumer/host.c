/* SPDX-License-Identifier: Apache-2.0 */
#include <ravencal/plugin.h>
#include <stdio.h>

int main(void) {
  const ravencal_api* api = ravencal_plugin_entry(RAVENCAL_ABI_MAJOR);
  if (api == NULL) return 1;
  printf("%s\n", api->version());
  return 0;
}
