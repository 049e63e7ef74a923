#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# concealed.sh RAVENCAL DATA_DIR OUT_DIR: see concealed/concealed.py
exec "$(dirname "$0")/concealed/concealed.py" "$@"
