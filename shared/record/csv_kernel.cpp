// SPDX-License-Identifier: Apache-2.0
#include "record/csv_kernel.hpp"

#include <cmath>
#include <cstring>

#include "record/csv_number.hpp"

namespace ravencal::record {
namespace {

std::size_t split(const char* line, std::size_t limit, std::uint32_t* ends) {
  const char* const stop = static_cast<const char*>(std::memchr(line, '\n', SIZE_MAX / 2));
  std::size_t count = 0;
  const char* at = line;
  while (count <= limit) {
    const void* comma = std::memchr(at, ',', static_cast<std::size_t>(stop - at));
    const char* const end = comma == nullptr ? stop : static_cast<const char*>(comma);
    ends[count++] = static_cast<std::uint32_t>(end - line);
    if (end == stop) break;
    at = end + 1;
  }
  return count;
}

bool parse(const char* line, const std::uint32_t* ends, std::span<const NumberField> fields,
           double* row) {
  for (const NumberField& field : fields) {
    const char* const first = field.field == 0 ? line : line + ends[field.field - 1] + 1;
    const char* const last = line + ends[field.field];
    double value = 0.0;
    if (parse_number(first, last, value) != last || !std::isfinite(value)) return false;
    row[field.target] = value;
  }
  return true;
}

constexpr CsvKernel kPortable = {split, parse};

}  // namespace

const CsvKernel& portable_csv_kernel() { return kPortable; }

const CsvKernel& csv_kernel() {
  const CsvKernel* const fast = avx512_csv_kernel();
  return fast != nullptr ? *fast : kPortable;
}

}  // namespace ravencal::record
