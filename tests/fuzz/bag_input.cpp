// SPDX-License-Identifier: Apache-2.0
#include "fuzz/inputs.hpp"
#include "record/load.hpp"

namespace ravencal::fuzz {

void try_bag(Bytes bytes) {
  const auto path = scratch_file("fuzz.bag", bytes);
  for (const char* profile : {"raven2-bag", "raven2-bag-truth"}) {
    record::LoadOptions options;
    options.profile = profile;
    options.skip_bad = bytes.size() % 2 == 1;
    const auto loaded = record::load_recording(path, options);
    if (!read_or_words(loaded, path.string())) continue;
    promise(static_cast<std::size_t>(loaded->rows()) == loaded->t_ns.size(), "as many stamps");
    for (std::size_t i = 1; i < loaded->t_ns.size(); ++i) {
      promise(loaded->t_ns[i - 1] <= loaded->t_ns[i], "time never decreases");
    }
  }
}

}  // namespace ravencal::fuzz
