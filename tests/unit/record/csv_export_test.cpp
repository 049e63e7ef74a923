// SPDX-License-Identifier: Apache-2.0
#include "record/csv_export.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "record/csv_number.hpp"
#include "record/load.hpp"
#include "record/recording_writer.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

std::vector<std::vector<double>> numbers_in(const std::filesystem::path& path) {
  std::vector<std::vector<double>> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    rows.emplace_back();
    std::size_t at = 0;
    while (at != std::string::npos) {
      const std::size_t comma = line.find(',', at);
      rows.back().push_back(number_of(std::string_view(line).substr(at, comma - at)).value());
      at = comma == std::string::npos ? comma : comma + 1;
    }
  }
  return rows;
}

/// A file as the authors' scripts write it: float32 message values printed with 18 digits.
std::string raven2_text(int rows) {
  std::mt19937 random(3);
  std::normal_distribution<float> value(0.0F, 50.0F);
  std::string text;
  for (int r = 0; r < rows; ++r) {
    text += fmt::format("{:.18e}", 0.01 * r);
    for (int c = 1; c < 252; ++c) {
      const double stamp = 1670000000.25 + 0.01 * r;
      text +=
          fmt::format(",{:.18e}", c == 4 || c == 12 ? stamp : static_cast<double>(value(random)));
    }
    text += "\n";
  }
  return text;
}

// One unit in the last place of a double is what the change of unit may cost.
TEST(CsvExport, WritesTheRaven2FileThatWasImported) {
  const Scratch scratch;
  for (const std::string arm : {"gold", "green"}) {
    const auto source = scratch.write("in.csv", raven2_text(50));
    LoadOptions options;
    options.profile = "raven2";
    options.profile_options.arm = arm;
    const auto loaded = load_recording(source, options);
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    ASSERT_TRUE(write_recording(*loaded, scratch / "r.db", true).ok());
    const auto stored = load_recording(scratch / "r.db", {});
    ASSERT_TRUE(stored.ok());
    const auto profile = load_profile("raven2", {arm});
    ASSERT_TRUE(export_csv(*stored, *profile, scratch / "out.csv").ok());

    const auto before = numbers_in(source);
    const auto after = numbers_in(scratch / "out.csv");
    ASSERT_EQ(before.size(), after.size());
    const auto measured_js = arm == "gold" ? 13U : 21U;
    for (std::size_t r = 0; r < before.size(); ++r) {
      ASSERT_EQ(after[r].size(), 252U);
      for (std::size_t c = 0; c < 252; ++c) {
        if (c >= 4 && c < 12) continue;
        const double ulp =
            std::nextafter(std::abs(before[r][c]), HUGE_VAL) - std::abs(before[r][c]);
        ASSERT_NEAR(after[r][c], before[r][c], ulp) << "row " << r << " column " << c;
      }
      EXPECT_EQ(after[r][4], after[r][12]);
      EXPECT_NEAR(after[r][5], before[r][measured_js] * M_PI / 180, 1e-12);
      EXPECT_NEAR(after[r][8], before[r][measured_js + 4] * M_PI / 180, 1e-12)
          << "void is left out";
    }
  }
}

TEST(CsvExport, OfAGenericRecordingReadsBackEqual) {
  const Scratch scratch;
  LoadOptions options;
  options.profile = "generic";
  const auto loaded = load_recording(
      scratch.write("a.csv",
                    "t_s,truth.elbow_deg,tau_N_m\n0.5,30.1,1e-300\n1670000000.123456789,-2,3\n"),
      options);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  const auto profile = load_profile("generic");
  ASSERT_TRUE(export_csv(*loaded, *profile, scratch / "b.csv").ok());
  const auto again = load_recording(scratch / "b.csv", options);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->samples, loaded->samples);
  EXPECT_EQ(again->t_ns, loaded->t_ns);
  EXPECT_EQ(again->channels[0].role, Role::kJointTruth);
}

TEST(CsvExport, WritesTheHeaderOfAProfileInItsUnits) {
  const Scratch scratch;
  const auto path = scratch.write(
      "p.toml", "[source]\ntime = 't'\n[[channel]]\nname = 'q'\ncolumn = 'q deg'\nunit = 'deg'\n");
  const auto profile = load_profile(path.string());
  LoadOptions options;
  options.profile = path.string();
  const auto loaded = load_recording(scratch.write("a.csv", "t,q deg\n0,30.1\n"), options);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  ASSERT_TRUE(export_csv(*loaded, *profile, scratch / "b.csv").ok());
  std::ifstream file(scratch / "b.csv");
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(text, "t,q deg\n0.000000000,30.1\n");
}

class CsvExportScaled : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Channel, CsvExportScaled,
                         ::testing::Values("negate = true\n", "scale = -2\noffset = 5\n",
                                           "offset = 5\nrelative = true\n"));

TEST_P(CsvExportScaled, GivesBackTheValueOfTheFile) {
  const Scratch scratch;
  const auto path =
      scratch.write("p.toml", std::string("[source]\ntime = 't'\n[[channel]]\nname = 'q'\n"
                                          "column = 'q deg'\nunit = 'deg'\n") +
                                  GetParam());
  const auto profile = load_profile(path.string());
  LoadOptions options;
  options.profile = path.string();
  const auto loaded = load_recording(scratch.write("a.csv", "t,q deg\n0,30.1\n"), options);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  ASSERT_TRUE(export_csv(*loaded, *profile, scratch / "b.csv").ok());
  std::ifstream file(scratch / "b.csv");
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(text, "t,q deg\n0.000000000,30.1\n");
}

TEST(CsvExport, NamesTheChannelThatIsMissing) {
  const Scratch scratch;
  Recording recording;
  recording.source = "r.db";
  recording.samples.resize(0, 0);
  const auto status = export_csv(recording, *load_profile("raven2"), scratch / "b.csv");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(
      status.error().message,
      "r.db: no channel truth.shoulder, which profile raven2 needs; `ravencal merge` puts the "
      "truth of a recording of encoders beside the robot's states");
  EXPECT_EQ(scratch.file_count(), 0U);
}

}  // namespace
}  // namespace ravencal::record
