// SPDX-License-Identifier: Apache-2.0
//
// Foreign tables in: files that NumPy, SciPy and h5py write, through profiles.
#include <cmath>

#include "exchange/table_file.hpp"
#include "unit/exchange_rig.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

using ExchangeTable = ExchangeRig;

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

TEST_F(ExchangeTable, OfACsvWithABadRowIsGuessedWithTheOptionThatTheErrorNames) {
  std::string text = "t_s;j1_position_rad;j1_effort_Nm\n";
  const auto with_comma = [](double value) {
    std::string number = fmt::format("{:.5f}", value);
    number[number.find('.')] = ',';
    return number;
  };
  for (int i = 0; i < 60; ++i)
    text += i == 30 ? "0,3\n"
                    : fmt::format("{};{};{}\n", with_comma(0.02 * i),
                                  with_comma(std::sin(0.11 * i)), with_comma(std::cos(0.17 * i)));
  write("a.csv", text);
  const Outcome refused = ravencal("profile guess a.csv");
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.text.find("a.csv:32: 1 columns where 3 are needed; use --skip-bad"),
            std::string::npos)
      << refused.text;
  const Outcome guessed = ravencal("profile guess a.csv --skip-bad --out p.toml");
  EXPECT_EQ(guessed.exit_code, 0) << guessed.text;
  const Outcome read = ravencal("import a.csv --profile p.toml --skip-bad --out a.db");
  EXPECT_TRUE(read.text.starts_with("a.db: 59 rows, 2 channels\n1 rows dropped")) << read.text;
  ASSERT_EQ(ravencal("profile guess a.csv --skip-bad --out a.csv.toml").exit_code, 0);
  const Outcome exported = ravencal("export a.csv --out b.h5");
  EXPECT_NE(exported.text.find("use --skip-bad"), std::string::npos) << exported.text;
  const Outcome dropped = ravencal("export a.csv --skip-bad --out b.h5");
  EXPECT_EQ(dropped.exit_code, 0) << dropped.text;
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

TEST_F(ExchangeTable, IsDescribedColumnByColumnWhereNoProfileReadsIt) {
  write("a.csv", "t,axis,q\n0,x,1\n0.01,y,nan\n0.02,x,-3\n");
  const std::string words = ravencal("info a.csv").text;
  for (const char* part : {"a table of 3 columns", "rises by 0.01 (100 Hz if it is in s)",
                           "words: x, y, 3 without a number", "-3 .. 1 ", ", 1 without a number"})
    EXPECT_NE(words.find(part), std::string::npos) << part << " in " << words;
  const std::string json = ravencal("info a.csv --json").text;
  EXPECT_NE(json.find("\"kind\": \"table\""), std::string::npos) << json;
  EXPECT_NE(json.find("\"step\": 0.01"), std::string::npos) << json;
  write("g.csv", "t_s,q_rad\n0,1\n1,2\n");
  EXPECT_NE(ravencal("info g.csv --profile generic").text.find("a recording of"),
            std::string::npos);
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

TEST_F(ExchangeTable, OfMatlabIsReadThroughAProfile) {
  if (!python("scipy.io", std::string(kArrays) + R"(
import scipy.io
scipy.io.savemat("a.mat", {"t": t, "q": q, "ok": np.array([1, 1, 1, 1, 0], dtype=bool)})
scipy.io.savemat("b.mat", {"t": t.reshape(5, 1), "q": q, "ok": np.array([[1, 1, 1, 1, 0]], dtype="i1")},
                 do_compression=True)
scipy.io.savemat("s.mat", {"log": {"left": {"t": t, "q": q}, "fs": 100.0}, "note": "of a run",
                           "many": np.array([{"a": 1}, {"a": 2}]), "z": 1j * t})
)"))
    GTEST_SKIP() << "/usr/bin/python3 has no scipy";
  for (const char* name : {"a.mat", "b.mat"}) {
    SCOPED_TRACE(name);
    expect_arrays(load(name, kProfile));
  }
  const auto nested = load("s.mat",
                           "[source]\ntime = 'log.left.t'\n[[channel]]\nname = 'a'\n"
                           "column = 'log.left.q[0]'\nunit = 'rad'\n");
  ASSERT_TRUE(nested.ok()) << nested.error().message;
  EXPECT_EQ(nested->samples(4, 0), 9.0);
  const auto table = exchange::read_table(folder_ / "s.mat");
  ASSERT_TRUE(table.ok()) << table.error().message;
  EXPECT_EQ(table->left_out.at("note"), "it is the text 'of a run'");
  EXPECT_NE(table->left_out.at("z").find("complex"), std::string::npos);
  EXPECT_NE(table->left_out.at("many").find("cell array"), std::string::npos);
}

/// MATLAB's level 7.3 is HDF5 behind 512 bytes of its own, with matrices the other way round and
/// their class in an attribute (MathWorks, MAT-File Versions); h5py writes one as MATLAB does.
TEST_F(ExchangeTable, OfMatlab73IsReadThroughAProfile) {
  if (!python("h5py", std::string(kArrays) + R"(
import h5py
with h5py.File("a.mat", "w", userblock_size=512) as f:
    for name, values, kind in (("t", t.reshape(5, 1), "double"), ("q", q, "double"),
                               ("ok", np.array([[1], [1], [1], [1], [0]], dtype="u1"), "logical")):
        d = f.create_dataset(name, data=values.T, chunks=True, compression="gzip")
        text = h5py.h5t.C_S1.copy()
        text.set_size(len(kind))
        space = h5py.h5s.create(h5py.h5s.SCALAR)
        h5py.h5a.create(d.id, b"MATLAB_class", text, space).write(np.array(kind, "S"), mtype=text)
        if kind == "logical": d.attrs["MATLAB_int_decode"] = np.int32(1)
with open("a.mat", "r+b") as f:
    f.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
)"))
    GTEST_SKIP() << "/usr/bin/python3 has no h5py";
  expect_arrays(load("a.mat", kProfile));
}

TEST_F(ExchangeTable, OfHdf5IsReadThroughAProfile) {
  if (!python("h5py", std::string(kArrays) + R"(
import h5py
with h5py.File("a.h5", "w") as f:
    f["t"] = t
    f.create_dataset("q", data=q, chunks=(2, 1), compression="gzip", shuffle=True)
    f["ok"] = np.array([1, 1, 1, 1, 0], dtype=bool)
with h5py.File("g.hdf5", "w") as f:
    f["run/left/time"] = (1e9 * t).astype("u8")
    f["run/left/q"] = q.astype(">f4")
    f["run/axis"] = ["x", "y", "x", "x", "x"]
    f["run/fixed"] = np.array([b"x", b"y", b"x", b"x", b"x"])
    f["run/both"] = np.zeros(5, dtype=[("a", "f8"), ("b", "f8")])
    f.create_dataset("run/never", shape=(10**15,), dtype="f8", chunks=(1000,))
    f["loop"] = h5py.SoftLink("/")
    f["run/again"] = f["run"]
)"))
    GTEST_SKIP() << "/usr/bin/python3 has no h5py";
  expect_arrays(load("a.h5", kProfile));
  const auto grouped = load("g.hdf5",
                            "[source]\ntime = 'run/left/time'\ntime_unit = 'ns'\n"
                            "[[filter]]\ncolumn = 'run/axis'\nkeep = 'x'\n"
                            "[[filter]]\ncolumn = 'run/fixed'\nkeep = 'x'\n"
                            "[[channel]]\nname = 'a'\ncolumn = 'run/left/q[0]'\nunit = 'rad'\n");
  ASSERT_TRUE(grouped.ok()) << grouped.error().message;
  ASSERT_EQ(grouped->rows(), 4);
  EXPECT_EQ(grouped->samples(1, 0), 5.0);
  EXPECT_EQ(grouped->t_ns[1], 10'020'000'000);
  const auto table = exchange::read_table(folder_ / "g.hdf5");
  ASSERT_TRUE(table.ok()) << table.error().message;
  EXPECT_NE(table->left_out.at("run/both").find("neither numbers nor texts"), std::string::npos);
  EXPECT_NE(table->left_out.at("run/never").find("never written"), std::string::npos);
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
