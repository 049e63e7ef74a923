// SPDX-License-Identifier: Apache-2.0
//
// Foreign tables in: files that NumPy, SciPy and h5py write, through profiles.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "exchange/load.hpp"
#include "exchange/table_file.hpp"
#include "unit/run_command.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

class ExchangeTable : public ::testing::Test {
 protected:
  ExchangeTable() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~ExchangeTable() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  /// Runs a script of Python with numpy as np; false where the module is not installed.
  [[nodiscard]] bool python(const std::string& module, const std::string& script) const {
    const auto run = [&](const std::string& command) {
      return run_command(fmt::format("cd '{}' && {} 2>&1", folder_.string(), command));
    };
    if (run("/usr/bin/python3 -c 'import numpy, " + module + "'").exit_code != 0) return false;
    write("script.py", "import numpy as np\n" + script);
    const Outcome outcome = run("/usr/bin/python3 script.py");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
    return true;
  }
  /// Arguments of ravencal; output and errors together.
  [[nodiscard]] Outcome ravencal(const std::string& arguments) const {
    return run_command(
        fmt::format("cd '{}' && '{}' {} 2>&1", folder_.string(), RAVENCAL_PROGRAM, arguments));
  }
  [[nodiscard]] core::Result<record::Recording> load(const std::string& name,
                                                     const std::string& profile) const {
    record::LoadOptions options;
    options.profile = write("p.toml", profile).string();
    return exchange::load_recording(folder_ / name, options);
  }

  fs::path folder_ =
      fs::temp_directory_path() / fmt::format("ravencal_exchange_table_test_{}", ::getpid());
};

const record::TableColumn* column_of(const record::Table& table, const std::string& name) {
  for (const record::TableColumn& column : table.columns) {
    if (column.name == name) return &column;
  }
  return nullptr;
}

TEST_F(ExchangeTable, OfACsvHasNumbersAndWords) {
  const auto table = exchange::read_table(write("a.csv", "# t,axis,q\n0,x,1\n1,,nan\n2,y,+3e1\n"));
  ASSERT_TRUE(table.ok()) << table.error().message;
  ASSERT_EQ(table->columns.size(), 3U);
  EXPECT_TRUE(table->has_header);
  EXPECT_EQ(table->columns[0].name, "t");
  EXPECT_EQ(table->columns[0].values, (std::vector<double>{0, 1, 2}));
  EXPECT_TRUE(table->columns[0].texts.empty());
  EXPECT_EQ(table->columns[1].texts, (std::vector<std::string>{"x", "", "y"}));
  EXPECT_TRUE(std::isnan(table->columns[1].values[0]));
  EXPECT_TRUE(std::isnan(table->columns[2].values[1]));
  EXPECT_EQ(table->columns[2].values[2], 30.0);
}

TEST_F(ExchangeTable, OfACsvWithoutHeaderHasNumbersForNames) {
  const auto table = exchange::read_table(write("a.csv", "0,1.5\n1,2.5\n"));
  ASSERT_TRUE(table.ok()) << table.error().message;
  EXPECT_FALSE(table->has_header);
  EXPECT_EQ(table->columns[1].name, "1");
  EXPECT_EQ(table->columns[1].values, (std::vector<double>{1.5, 2.5}));
}

TEST_F(ExchangeTable, OfACsvNamesTheLineThatIsNoRowAndLeavesItOutIfAsked) {
  const fs::path path = write("a.csv", "t,q\n0,1\n1\n2,3\n");
  EXPECT_EQ(exchange::read_table(path).error().message,
            path.string() + ":3: 1 columns where 2 are needed; use --skip-bad to drop such rows");
  record::LoadOptions options;
  options.skip_bad = true;
  const auto table = exchange::read_table(path, options);
  ASSERT_TRUE(table.ok()) << table.error().message;
  EXPECT_EQ(table->columns[1].values, (std::vector<double>{1, 3}));
  ASSERT_EQ(table->events.size(), 1U);
  EXPECT_EQ(table->events[0].detail, "line 3: 1 columns where 2 are needed");
}

TEST_F(ExchangeTable, IsCutToATimeRangeByTheCommandsThatReadIt) {
  write("a.csv", "t_s,q_rad\n5,0\n6,1\n7,2\n8,3\n");
  ASSERT_EQ(ravencal("import a.csv --profile generic --from-s 1 --out a.db").exit_code, 0);
  EXPECT_NE(ravencal("info a.db --to-s 1.5").text.find("2 rows"), std::string::npos)
      << ravencal("info a.db --to-s 1.5").text;
  EXPECT_EQ(ravencal("export a.db --to-s 1.5 --out b.csv").text, "b.csv: 2 rows\n");
  const Outcome empty = ravencal("info a.db --from-s 20");
  EXPECT_EQ(empty.exit_code, 2);
  EXPECT_NE(empty.text.find("the recording is 2 s long"), std::string::npos) << empty.text;
  EXPECT_EQ(ravencal("info a.db --from-s nan").exit_code, 2);
}

constexpr const char* kArrays = R"(
rows = np.arange(5)
t = 10.0 + 0.01 * rows
q = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, np.nan], [7.0, 8.0], [9.0, 10.0]])
)";

constexpr const char* kProfile = R"([source]
time = "t"
[[filter]]
column = "ok"
keep = [1]
[[channel]]
name = "truth.a"
column = "q[1]"
unit = "mm"
role = "joint_truth"
joint = "a"
scale = -2
may_be_missing = true
[[channel]]
name = "estimate.a"
column = "q[0]"
unit = "mm"
role = "joint_estimate"
joint = "a"
relative = true
)";

/// Of kArrays through kProfile, where the last row is not ok.
void expect_arrays(const core::Result<record::Recording>& r) {
  ASSERT_TRUE(r.ok()) << r.error().message;
  ASSERT_EQ(r->rows(), 4);
  EXPECT_EQ(r->t_ns.front(), 10'000'000'000);
  EXPECT_EQ(r->t_ns.back(), 10'030'000'000);
  EXPECT_DOUBLE_EQ(r->samples(1, 0), -0.008);
  EXPECT_TRUE(std::isnan(r->samples(2, 0)));
  EXPECT_DOUBLE_EQ(r->samples(3, 1), 0.006);
  EXPECT_EQ(r->meta.at("origin.estimate.a"), "0.001");
  EXPECT_EQ(r->channels[0].role, record::Role::kJointTruth);
  EXPECT_EQ(r->channels[0].unit, "m");
}

TEST_F(ExchangeTable, OfNumpyIsReadThroughAProfile) {
  if (!python("numpy", std::string(kArrays) + R"(
np.savez("a.npz", t=t, q=q, ok=np.array([1, 1, 1, 1, 0], dtype=bool))
np.savez_compressed("b.npz", t=t, q=np.asfortranarray(q), ok=np.array([1, 1, 1, 1, 0], dtype="i2"))
np.savez("c.npz", t=t.reshape(1, 5), q=q.astype("f2"), ok=np.array([[1], [1], [1], [1], [0]]))
np.save("d.npy", np.column_stack([t, q]))
)"))
    GTEST_SKIP() << "/usr/bin/python3 has no numpy";
  for (const char* name : {"a.npz", "b.npz", "c.npz"}) {
    SCOPED_TRACE(name);
    expect_arrays(load(name, kProfile));
  }
  const auto plain = load("d.npy",
                          "[source]\nheader = false\ntime = 0\n"
                          "[[channel]]\nname = 'a'\nindex = 1\nunit = 'rad'\n");
  ASSERT_TRUE(plain.ok()) << plain.error().message;
  EXPECT_EQ(plain->t_ns[1], 10'010'000'000);
  EXPECT_EQ(plain->samples(4, 0), 9.0);
}

TEST_F(ExchangeTable, OfNumpySaysWhatCanBeNoColumn) {
  if (!python("numpy", R"(
np.savez("a.npz", t=np.arange(3.0), word=np.array(["x", "y", "x"]), cube=np.zeros((2, 3, 4)),
         z=np.zeros(3, dtype=complex), wide=np.zeros((3, 4000)), fs=100.0)
)"))
    GTEST_SKIP() << "/usr/bin/python3 has no numpy";
  const auto table = exchange::read_table(folder_ / "a.npz");
  ASSERT_TRUE(table.ok()) << table.error().message;
  ASSERT_NE(column_of(*table, "word"), nullptr);
  EXPECT_EQ(column_of(*table, "word")->texts, (std::vector<std::string>{"x", "y", "x"}));
  ASSERT_NE(column_of(*table, "fs"), nullptr);
  EXPECT_EQ(column_of(*table, "fs")->values, std::vector<double>{100.0});
  EXPECT_EQ(table->columns.size(), 3U);
  EXPECT_NE(table->left_out.at("cube").find("2 x 3 x 4"), std::string::npos);
  EXPECT_NE(table->left_out.at("z").find("<c16"), std::string::npos);
  EXPECT_NE(table->left_out.at("wide").find("transpose"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::test
