// SPDX-License-Identifier: Apache-2.0
//
// Numbers as text, in every form that printf has, against the C library's own strtod.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

#include "record/csv_kernel.hpp"

namespace ravencal::record {
namespace {

struct Line {
  std::string text;  ///< with padding
  std::vector<std::string> fields;
};

Line make_line(const std::vector<std::string>& fields) {
  Line line{fmt::format("{}", fmt::join(fields, ",")) + "\n", fields};
  line.text.append(kCsvPadding, ',');
  return line;
}

/// A number halfway between two doubles, or next to it, with 19 digits as numpy.savetxt writes
/// them.
std::string near_halfway(std::mt19937_64& random) {
  const std::uint64_t odd = ((random() >> 11U) | (std::uint64_t{1} << 52U)) * 2 + 1;
  const std::uint64_t value = (odd << (random() % 9U)) + random() % 3U - 1;
  std::string text = std::to_string(value);
  const std::size_t exponent = text.size() - 1;
  text.resize(19, '0');
  return fmt::format("{}.{}e+{:02}", text[0], text.substr(1), exponent);
}

std::string any_number(std::mt19937_64& random) {
  if (random() % 8 == 0) return near_halfway(random);
  double value = 0.0;
  switch (random() % 4) {
    case 0:
      value = std::bit_cast<double>(random());
      break;
    case 1:
      value = std::normal_distribution<double>(0.0, 100.0)(random);
      break;
    case 2:
      value = static_cast<double>(static_cast<std::int64_t>(random() % 2000001) - 1000000);
      break;
    default:
      value = static_cast<double>(std::normal_distribution<float>(0.0F, 1.0F)(random));
      break;
  }
  if (!std::isfinite(value)) value = 0.0;
  const int digits = static_cast<int>(random() % 25);
  switch (random() % 7) {
    case 0:
      return fmt::format("{}", value);
    case 1:
      return fmt::format("{:.{}e}", value, digits);
    case 2:
      return fmt::format("{:.{}g}", value, digits);
    case 3:
      return fmt::format("{:.{}E}", value, digits);
    case 4:
    case 5:
      return fmt::format("{:.18e}", value);
    default:
      return std::abs(value) < 1e9 ? fmt::format("{:.{}f}", value, digits)
                                   : fmt::format("{:.18e}", value);
  }
}

void expect_all_right(const CsvKernel& kernel, const Line& line) {
  std::vector<std::uint32_t> ends(line.fields.size() + 1 + kCsvFieldSlack);
  ASSERT_EQ(kernel.split(line.text.data(), line.fields.size(), ends.data()), line.fields.size());
  std::vector<NumberField> numbers;
  for (std::uint32_t i = 0; i < line.fields.size(); ++i) numbers.push_back({i, i});
  std::vector<double> row(line.fields.size());
  ASSERT_TRUE(kernel.parse(line.text.data(), ends.data(), numbers, row.data())) << line.text;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const double expected = std::strtod(line.fields[i].c_str(), nullptr);
    ASSERT_EQ(std::memcmp(&row[i], &expected, sizeof(double)), 0)
        << line.fields[i] << " became " << fmt::format("{}", row[i]);
  }
}

void check_against_strtod(const CsvKernel& kernel) {
  std::mt19937_64 random(11);
  for (int l = 0; l < 4000; ++l) {
    std::vector<std::string> fields;
    const std::size_t count = 1 + random() % 200;
    for (std::size_t i = 0; i < count; ++i) fields.push_back(any_number(random));
    expect_all_right(kernel, make_line(fields));
    if (::testing::Test::HasFatalFailure()) return;
  }
}

void refuse_no_numbers(const CsvKernel& kernel) {
  for (const char* text : {"",
                           "-",
                           "+",
                           ".",
                           "-.",
                           "e5",
                           "1e",
                           "1e+",
                           "1e-",
                           "1e5.",
                           "1e.5",
                           "1.2.3",
                           "1-2",
                           "--1",
                           "1e1e1",
                           "nan",
                           "inf",
                           "-inf",
                           "1e999",
                           "0x10",
                           "1,",
                           "1 ",
                           " 1",
                           "1x",
                           "e+05",
                           ".e+05",
                           "1e+0x",
                           "1:",
                           "1/",
                           "1e+:0",
                           "1111111111111111111111111111111111x",
                           "1.0e+1.",
                           "-e+01"}) {
    const Line line = make_line({text});
    std::vector<std::uint32_t> ends(2 + kCsvFieldSlack);
    const std::size_t count = kernel.split(line.text.data(), 1, ends.data());
    const NumberField field{0, 0};
    double value = 0.0;
    EXPECT_TRUE(count != 1 || !kernel.parse(line.text.data(), ends.data(), {&field, 1}, &value))
        << text;
  }
}

TEST(PortableCsvKernel, ReadsEveryNumberAsStrtodDoes) {
  check_against_strtod(portable_csv_kernel());
}
TEST(PortableCsvKernel, RefusesWhatIsNoNumber) { refuse_no_numbers(portable_csv_kernel()); }

TEST(Avx512CsvKernel, ReadsEveryNumberAsStrtodDoes) {
  if (avx512_csv_kernel() == nullptr) GTEST_SKIP() << "this machine has no AVX-512 VBMI2";
  check_against_strtod(*avx512_csv_kernel());
}

TEST(Avx512CsvKernel, RefusesWhatIsNoNumber) {
  if (avx512_csv_kernel() == nullptr) GTEST_SKIP() << "this machine has no AVX-512 VBMI2";
  refuse_no_numbers(*avx512_csv_kernel());
}

}  // namespace
}  // namespace ravencal::record
