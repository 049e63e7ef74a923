// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

namespace ravencal::prove {

/// A share with its 95 % interval.
struct Share {
  int hits = 0, of = 0;
  void count(bool hit) {
    hits += hit ? 1 : 0;
    ++of;
  }
  [[nodiscard]] double value() const { return of > 0 ? static_cast<double>(hits) / of : 0.0; }
};

/// Wilson's score interval (JASA 1927), 95 %; [0, 1] without cases.
std::pair<double, double> wilson(const Share& share);
/// Upper end of the exact two-sided 95 % interval (Clopper and Pearson, Biometrika 1934).
double clopper_pearson_upper(const Share& share);

double median_of(std::vector<double> values);
/// 95 % percentile interval of the median over 2000 resamples, same seed every time.
std::pair<double, double> bootstrap_median(const std::vector<double>& values);

/// Length of the intersection over that of the union; intervals within one list may overlap.
double interval_overlap(std::vector<std::pair<double, double>> a,
                        std::vector<std::pair<double, double>> b);

}  // namespace ravencal::prove
