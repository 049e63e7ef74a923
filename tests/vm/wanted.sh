# SPDX-License-Identifier: Apache-2.0
#
# Sourced with set = short or long: ends with 77 and the reason where such a test is not asked for.
skip() { echo "SKIP: $*"; exit 77; }
case ${RAVENCAL_VM_TESTS:-none}:$set in
  all:* | short:short) ;;
  short:long) skip "takes many minutes; tools/run test-vm runs it" ;;
  *) skip "needs an emulated machine (330 MB of downloads); tools/run test and test-vm run it" ;;
esac
