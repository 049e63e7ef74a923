// SPDX-License-Identifier: Apache-2.0
//
// The plugin's header in the oldest and the newest C++ that a controller may be written in.
// Compiled once per standard; RAVENCAL_STANDARD names the function.
#include "ravencal/control.h"
#include "ravencal/plugin.h"
#include "ravencal/telemetry.h"

int RAVENCAL_STANDARD();

int RAVENCAL_STANDARD() { return static_cast<int>(sizeof(ravencal_state)); }
