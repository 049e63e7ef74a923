// SPDX-License-Identifier: Apache-2.0
//
// rt_weights FILE: the light network with made-up weights, for the loop in the emulated machine.
#include <cstdio>

#include "model/blob_writer.hpp"
#include "rt/rig.hpp"

int main(int argc, char** argv) {
  using namespace ravencal;
  if (argc != 2) {
    std::fputs("usage: rt_weights FILE\n", stderr);
    return 2;
  }
  model::CalibrationModel model = test::make_model(112, {128, 64, 32});
  model.origin.arm = model::Arm::kGold;  // the plant's
  const auto precision = model::packed::Precision::kFloat32;
  return model::write_blob(model, argv[1], test::packing_of(model, precision)).ok() ? 0 : 3;
}
