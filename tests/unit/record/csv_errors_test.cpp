// SPDX-License-Identifier: Apache-2.0
//
// Every kind of wrong CSV, and the sentence that answers it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "record/load.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

struct Case {
  std::string what;
  std::string text;
  std::string complaint;  ///< what follows the file name
};

std::string error_of(const std::filesystem::path& path, const std::string& profile) {
  LoadOptions options;
  options.profile = profile;
  const auto loaded = load_recording(path, options);
  return loaded.ok() ? "no error" : loaded.error().message;
}

const std::string kHeader = "t_s,estimate.elbow_deg,truth.elbow_rad\n";
const std::string kRemedy = "; use --skip-bad to drop such rows";

TEST(WrongCsv, IsAnsweredWithFileLineColumnAndValue) {
  const Case cases[] = {
      {"short row", kHeader + "0,1,2\n1,2\n", ":3: 2 columns where 3 are needed" + kRemedy},
      {"long row", kHeader + "0,1,2,3\n", ":2: 4 columns where 3 are needed" + kRemedy},
      {"text", kHeader + "0,1,2\n1,x,2\n",
       ":3: column 2 (estimate.elbow): 'x' is not a number" + kRemedy},
      {"NaN", kHeader + "0,nan,2\n",
       ":2: column 2 (estimate.elbow): 'nan' is not a number" + kRemedy},
      {"inf", kHeader + "0,1,-inf\n",
       ":2: column 3 (truth.elbow): '-inf' is not a number" + kRemedy},
      {"overflow", kHeader + "0,1,1e999\n",
       ":2: column 3 (truth.elbow): '1e999' is not a number" + kRemedy},
      {"beyond any sensor", kHeader + "0,1,2\n1,1e30,2\n2,3.4e38,2\n",
       ": row 3: estimate.elbow is 5.93411945678072e+36, which no sensor measures; use --skip-bad"},
      {"half a number", kHeader + "0,1.2.3,1\n",
       ":2: column 2 (estimate.elbow): '1.2.3' is not a number" + kRemedy},
      {"empty field", kHeader + "0,,1\n",
       ":2: column 2 (estimate.elbow): the field is empty" + kRemedy},
      {"empty line", kHeader + "0,1,1\n\n2,1,1\n", ":3: the line is empty" + kRemedy},
      {"time backwards", kHeader + "1,1,1\n0.5,1,1\n",
       ":3: time runs backwards, from 1 s to 0.5 s" + kRemedy},
      {"time out of range", kHeader + "1e30,1,1\n", ":2: time 1e+30 s is out of range" + kRemedy},
      {"empty file", "", ": the file is empty"},
      {"only line ends", "\n\n\r\n", ": the file is empty"},
      {"no rows", kHeader, ": no rows; the file has columns and no values"},
      {"no time", "estimate.elbow_deg\n1\n",
       ":1: no column of time; call it t_s (or t_ms, t_us, t_ns)"},
      {"unknown unit", "t_s,elbow_furlong\n0,1\n", ":1: column 2 ('elbow_furlong'): unknown unit"},
      {"same name twice", "t_s,a_rad,a_deg\n0,1,2\n", ": a channel cannot be named 'a'"},
  };
  const Scratch scratch;
  for (const Case& c : cases) {
    const auto path = scratch.write("run3.csv", c.text);
    EXPECT_TRUE(error_of(path, "generic").starts_with(path.string() + c.complaint))
        << c.what << ": " << error_of(path, "generic");
  }
}

std::string raven2_row(double t, std::string_view fourteenth = "30") {
  std::string row = fmt::format("{}", t);
  for (int i = 1; i < 252; ++i) row += i == 13 ? fmt::format(",{}", fourteenth) : ",1";
  return row + "\n";
}

TEST(WrongCsv, NamesTheRowOfALargeRaven2File) {
  const Scratch scratch;
  std::string text;
  for (int i = 1; i <= 3000; ++i)
    text += raven2_row(0.01 * i, i == 1842 || i == 2900 ? "nan" : "30");
  const auto path = scratch.write("run3.csv", text);
  EXPECT_EQ(error_of(path, "raven2"),
            path.string() + ":1842: column 14 (jpos.shoulder): 'nan' is not a number" + kRemedy);
}

TEST(WrongCsv, WithAnotherNumberOfColumnsIsNoRaven2File) {
  const Scratch scratch;
  const auto path = scratch.write("a.csv", "1,2,3\n");
  EXPECT_EQ(error_of(path, "raven2"),
            path.string() + ":1: 3 columns, but profile raven2 needs 252");
}

TEST(WrongCsv, WithoutAColumnOfTheProfileSaysWhichAndWhatThereIs) {
  const Scratch scratch;
  const auto profile = scratch.write(
      "p.toml", "[source]\ntime = 't'\n[[channel]]\nname = 'q'\ncolumn = 'q_rad'\nunit = 'rad'\n");
  const auto path = scratch.write("a.csv", "t,p\n0,1\n");
  EXPECT_EQ(error_of(path, profile.string()),
            path.string() + ":1: no column 'q_rad', which profile p needs; known: t, p");
}

TEST(WrongCsv, UnreadableSourcesAreNamed) {
  const Scratch scratch;
  EXPECT_NE(error_of(scratch / "none.csv", "raven2").find("No such file"), std::string::npos);
  EXPECT_NE(error_of(scratch.write("a.bag", "x"), "raven2").find("is for tables"),
            std::string::npos);
  EXPECT_NE(error_of(scratch.write("a.txt", "x"), "raven2").find("must end in .db, .csv or .bag"),
            std::string::npos);
  EXPECT_NE(error_of(scratch.write("a.csv", "x"), "").find("needs --profile"), std::string::npos);
  std::filesystem::create_directory(scratch / "folder.csv");
  EXPECT_NE(error_of(scratch / "folder.csv", "generic").find("not a file"), std::string::npos);
}

TEST(SkipBad, DropsCountsAndLeavesAnEventPerRow) {
  const Scratch scratch;
  const auto path =
      scratch.write("a.csv", kHeader + "0,1,2\nx,1,2\n1,2,3\n0.5,1,2\n2,1\n3,nan,1\n4,5,6\n");
  LoadOptions options;
  options.profile = "generic";
  options.skip_bad = true;
  const auto loaded = load_recording(path, options);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded->t_ns, (std::vector<std::int64_t>{0, 1000000000, 4000000000}));
  EXPECT_EQ(loaded->samples(2, 1), 6.0);
  EXPECT_EQ(loaded->meta.at("dropped_rows"), "4");
  ASSERT_EQ(loaded->events.size(), 4U);
  EXPECT_EQ(loaded->events[0].kind, "drop");
  EXPECT_EQ(loaded->events[0].t_ns, 0);
  EXPECT_EQ(loaded->events[0].detail, "line 3: column 1 (time): 'x' is not a number");
  EXPECT_EQ(loaded->events[3].t_ns, 1000000000);
  EXPECT_EQ(loaded->events[3].detail, "line 7: column 2 (estimate.elbow): 'nan' is not a number");
}

TEST(SkipBad, SaysSoWhenNothingIsLeft) {
  const Scratch scratch;
  const auto path = scratch.write("a.csv", kHeader + "x,1,2\n");
  LoadOptions options;
  options.profile = "generic";
  options.skip_bad = true;
  EXPECT_EQ(
      load_recording(path, options).error().message,
      path.string() +
          ": no row is left of 1: line 2: column 1 (time): 'x' is not a number; 1 rows are bad "
          "there; leave the column out of the profile, or state may_be_missing for its "
          "channel");
}

TEST(SkipBad, NamesTheColumnThatSpoilsEveryRow) {
  const Scratch scratch;
  const auto path = scratch.write("a.csv", kHeader + "0,1,nan\n1,1,nan\n2,nan,nan\n");
  LoadOptions options;
  options.profile = "generic";
  options.skip_bad = true;
  const std::string why = load_recording(path, options).error().message;
  EXPECT_NE(why.find("no row is left of 3: line 2: column 3"), std::string::npos) << why;
  EXPECT_NE(why.find("2 rows are bad there"), std::string::npos) << why;
}

}  // namespace
}  // namespace ravencal::record
