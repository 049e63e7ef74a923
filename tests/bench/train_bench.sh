#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Training speed beside PyTorch's (Debian's python3-torch with libopenblas0-pthread), one thread
# each, rounds interleaved in one run, best of each:
#   train_bench.sh TRAIN_BENCH [ROUNDS]
# Prints seconds per epoch, the share of this machine's measured sgemm peak, and the ratios.
set -euo pipefail
if (($# < 1)); then
  sed -n '4,7s/^# \{0,1\}//p' "$0" >&2
  exit 2
fi
bench=$1 rounds=${2:-3}
here=$(cd "$(dirname "$0")" && pwd)
if ! /usr/bin/python3 -c 'import torch' 2>/dev/null; then
  echo "train_bench.sh: PyTorch is missing (apt-get install python3-torch libopenblas0-pthread)" >&2
  exit 3
fi
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
avx512=$(grep -q avx512vl /proc/cpuinfo && echo SKYLAKEX || true)
lines=$(mktemp)
trap 'rm -f "$lines"' EXIT
for ((round = 0; round < rounds; ++round)); do
  "$bench" 1 4 >>"$lines"
  # OpenBLAS takes some new processors for old ones, so PyTorch also gets the choice of its AVX-512
  # kernels; what the caller's environment prescribes does not count.
  for core in "" $avx512; do
    env -u OPENBLAS_CORETYPE ${core:+OPENBLAS_CORETYPE=$core} \
      /usr/bin/python3 "$here/train_torch.py" 1 3 | sed 's/^{/{"peer": "torch", /' >>"$lines"
  done
done
/usr/bin/python3 - "$lines" <<'PYTHON'
import json
import sys

rows = [json.loads(line) for line in open(sys.argv[1])]
peak = max(r["sgemm_peak_gflops"] for r in rows if "peer" not in r)
for network in ("light", "paper"):
    ours = min((r for r in rows if r["network"] == network and "peer" not in r),
               key=lambda r: r["s_per_epoch"])
    torch = min(r["s_per_epoch"] for r in rows if r["network"] == network and "peer" in r)
    print(f'{network}: {ours["s_per_epoch"]:.4f} s/epoch of {ours["rows"]} rows ({ours["isa"]}), '
          f'{ours["gflops"]:.0f} GFLOP/s = {100 * ours["gflops"] / peak:.0f} % of the sgemm peak '
          f'of {peak:.0f}; PyTorch {torch:.4f} s; ratio {torch / ours["s_per_epoch"]:.2f}')
PYTHON
