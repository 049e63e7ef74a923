// SPDX-License-Identifier: Apache-2.0
#include "diagnose/channel/placebo.hpp"

#include <random>

namespace ravencal::diagnose {

using Eigen::Index;

PlaceboParts placebo_parts(const ChannelFit& fit) {
  const Series& series = *fit.series;
  PlaceboParts parts{fit.nominal->prediction, fit.held_out_residual, fit.model.blocks};
  if (series.payload_effort.size() > 0) parts.prediction += series.as_seen(series.payload_effort);
  for (std::size_t t = 0; t < fit.nominal->terms.size(); ++t) {
    parts.prediction += fit.coefficients[static_cast<Index>(t) + 1] * fit.nominal->terms[t].column;
  }
  return parts;
}

Series placebo_series(const Series& series, const PlaceboParts& parts, std::uint64_t seed) {
  Series out = series;
  std::mt19937_64 engine(seed);
  const Blocks& blocks = parts.blocks;
  out.y = parts.prediction;
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    const double sign = (engine() & 1U) != 0 ? 1.0 : -1.0;
    for (Index i = blocks.first(b); i < blocks.first(b) + blocks.size(b); ++i) {
      out.y[blocks.rows[static_cast<std::size_t>(i)]] += sign * parts.noise[i];
    }
  }
  return out;
}

}  // namespace ravencal::diagnose
