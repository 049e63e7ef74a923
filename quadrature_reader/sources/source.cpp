// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/source.hpp"

#include "quadrature_reader/sources/can.hpp"
#include "quadrature_reader/sources/counter.hpp"
#include "quadrature_reader/sources/gpio_source.hpp"
#include "quadrature_reader/sources/replay.hpp"

namespace ravencal::quadrature_reader {

core::Result<std::unique_ptr<Source>> make_source(const SourceSettings& settings) {
  switch (settings.kind) {
    case SourceKind::kGpio:
      return std::unique_ptr<Source>(std::make_unique<GpioSource>(settings, make_gpio_backend()));
    case SourceKind::kReplay:
      return std::unique_ptr<Source>(std::make_unique<ReplaySource>(settings));
    case SourceKind::kCan:
      return make_can_source(settings);
    case SourceKind::kCounter:
      return std::unique_ptr<Source>(std::make_unique<CounterSource>(settings));
  }
  return core::Error{core::ErrorCode::kUsage, "there is no such kind of source"};
}

}  // namespace ravencal::quadrature_reader
