// SPDX-License-Identifier: Apache-2.0
//
// Recordings out of ravencal: HDF5 and MAT read back by their own libraries and by SciPy and h5py,
// CSV as the authors' notebook and PlotJuggler read it, the database in the sqlite3 shell.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <matio.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <thread>

#include "core/catalogue.hpp"
#include "exchange/hdf5_export.hpp"
#include "exchange/hdf5_handle.hpp"
#include "exchange/load.hpp"
#include "exchange/mat_export.hpp"
#include "exchange/table_file.hpp"
#include "record/load.hpp"
#include "record/recording_writer.hpp"
#include "unit/run_command.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;
using exchange::Hdf5Handle;

constexpr int kRows = 20000;  // more than one chunk of HDF5

record::Recording sample_recording(int rows = kRows) {
  record::Recording recording;
  recording.meta = {
      {"robot", "RAVEN-II"}, {"clock.realtime_minus_monotonic_ns", "42"}, {"arm", "gold"}};
  recording.channels = {{"truth.elbow", "rad", record::Role::kJointTruth, "elbow"},
                        {"jpos.elbow", "rad", record::Role::kJointEstimate, "elbow"},
                        {"runlevel", "1", record::Role::kStatus, ""}};
  recording.samples.resize(rows, 3);
  for (int row = 0; row < rows; ++row) {
    recording.t_ns.push_back(row * std::int64_t{1'000'000});
    recording.samples.row(row) << std::sin(1e-3 * row), std::cos(1e-3 * row), row % 4;
  }
  if (rows > 7) recording.samples(7, 0) = std::nan("");
  recording.events = {{5'000'000, "homing", "1"}, {7'000'000, "edges_lost", "elbow \xc2\xb5"}};
  recording.source = "sample";
  return recording;
}

/// The 252 columns: every channel of the catalogue and the three truths.
record::Recording robot_recording() {
  constexpr int kShort = 40;
  record::Recording recording;
  recording.meta = {{"arm", "gold"}};
  for (const char* joint : {"shoulder", "elbow", "insertion"}) {
    const std::string unit = std::string_view(joint) == "insertion" ? "m" : "rad";
    recording.channels.push_back(
        {fmt::format("truth.{}", joint), unit, record::Role::kJointTruth, joint});
  }
  for (const core::CatalogueEntry& entry : core::catalogue()) {
    recording.channels.push_back({entry.name, entry.si_unit, record::Role::kFeature, ""});
  }
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  recording.samples = record::SampleMatrix::NullaryExpr(
      kShort, static_cast<Eigen::Index>(recording.channels.size()), [&] { return normal(random); });
  for (int row = 0; row < kShort; ++row) recording.t_ns.push_back(row * std::int64_t{10'000'000});
  return recording;
}

class Exchange : public ::testing::Test {
 protected:
  Exchange() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Exchange() override { fs::remove_all(folder_); }

  [[nodiscard]] Outcome run(const std::string& command) const {
    return run_command(fmt::format("cd '{}' && {} 2>&1", folder_.string(), command));
  }
  /// Runs a script that prints "ok"; skips where Python lacks the module.
  void expect_ok(const std::string& module, const std::string& script) const {
    if (run("/usr/bin/python3 -c 'import " + module + "'").exit_code != 0) {
      GTEST_SKIP() << "/usr/bin/python3 has no " << module;
    }
    std::ofstream(folder_ / "script.py") << script;
    EXPECT_EQ(run("/usr/bin/python3 script.py").text, "ok\n");
  }

  fs::path folder_ =
      fs::temp_directory_path() / fmt::format("ravencal_exchange_test_{}", ::getpid());
};

std::vector<double> doubles_in(hid_t file, const char* name) {
  const Hdf5Handle set(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
  std::vector<double> values(kRows);
  EXPECT_GE(H5Dread(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0)
      << name;
  return values;
}

TEST_F(Exchange, Hdf5HoldsEveryValueBitForBit) {
  const record::Recording recording = sample_recording();
  const fs::path path = folder_ / "r.h5";
  ASSERT_TRUE(exchange::export_hdf5(recording, path).ok());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
  const Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  ASSERT_TRUE(file.ok());
  for (std::size_t c = 0; c < recording.channels.size(); ++c) {
    const auto values = doubles_in(file.get(), ("channels/" + recording.channels[c].name).c_str());
    for (std::size_t row = 0; row < values.size(); ++row) {
      const double expected =
          recording.samples(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(c));
      ASSERT_TRUE(values[row] == expected || (std::isnan(values[row]) && std::isnan(expected)))
          << row;
    }
  }
  EXPECT_EQ(doubles_in(file.get(), "t_ns")[kRows - 1], 1e6 * (kRows - 1));
}

// Any file of its reader could become a recording that the reader then hands on.
TEST_F(Exchange, Hdf5TakesNothingFromOtherFiles) {
  using exchange::Hdf5Handle;
  ASSERT_TRUE(exchange::export_hdf5(sample_recording(), folder_ / "secret.h5").ok());
  const hsize_t size = 4;
  const Hdf5Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const auto refusal = [&](const char* name, const auto& make) {
    {
      const Hdf5Handle file(
          H5Fcreate((folder_ / name).c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
      const Hdf5Handle made(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
      make(file.get(), made.get());
      const Hdf5Handle set(H5Dcreate2(file.get(), "t", H5T_NATIVE_DOUBLE, space.get(), H5P_DEFAULT,
                                      made.get(), H5P_DEFAULT),
                           H5Dclose);
    }
    const auto read = exchange::read_table(folder_ / name);
    return read.ok() ? std::string() : read.error().message;
  };
  const std::string secret = (folder_ / "secret.h5").string();
  EXPECT_NE(refusal("external.h5",
                    [&](hid_t, hid_t made) { H5Pset_external(made, secret.c_str(), 0, 32); })
                .find("takes values from another file"),
            std::string::npos);
  EXPECT_NE(refusal("virtual.h5",
                    [&](hid_t, hid_t made) {
                      H5Pset_virtual(made, space.get(), secret.c_str(), "samples", space.get());
                    })
                .find("takes values from another file"),
            std::string::npos);
  (void)refusal("link.h5", [&](hid_t file, hid_t) {
    H5Lcreate_external(secret.c_str(), "/", file, "there", H5P_DEFAULT, H5P_DEFAULT);
  });
  const auto table = exchange::read_table(folder_ / "link.h5");
  if (table.ok()) {
    for (const auto& column : table->columns)
      EXPECT_EQ(column.name.find("there"), std::string::npos);
  }
}

TEST_F(Exchange, Hdf5IsReadByPython) {
  ASSERT_TRUE(exchange::export_hdf5(sample_recording(), folder_ / "r.h5").ok());
  ASSERT_TRUE(exchange::export_hdf5(record::Recording(), folder_ / "empty.h5").ok());
  expect_ok("h5py", R"(
import h5py, math
f = h5py.File("r.h5")
assert f.attrs["robot"] == "RAVEN-II"
assert [n.decode() for n in f["channel_order"]] == ["truth.elbow", "jpos.elbow", "runlevel"]
c = f["channels/jpos.elbow"]
assert c.attrs["unit"] == "rad" and c.attrs["role"] == "joint_estimate" and c.attrs["joint"] == "elbow"
assert c.shape == (20000,) and c[3] == math.cos(0.003)
assert math.isnan(f["channels/truth.elbow"][7])
assert f["t_ns"].dtype == "int64"
assert list(f["events/t_ns"]) == [5000000, 7000000] and f["events/detail"][1].decode() == "elbow \u00b5"
assert h5py.File("empty.h5")["t_ns"].shape == (0,)
print("ok"))");
}

TEST_F(Exchange, MatHoldsEveryValueBitForBit) {
  const record::Recording recording = sample_recording();
  const fs::path path = folder_ / "r.mat";
  ASSERT_TRUE(exchange::export_mat(recording, path).ok());
  const std::unique_ptr<mat_t, int (*)(mat_t*)> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY),
                                                     Mat_Close);
  ASSERT_TRUE(file);
  EXPECT_EQ(Mat_GetVersion(file.get()), MAT_FT_MAT5);
  const std::unique_ptr<matvar_t, void (*)(matvar_t*)> samples(Mat_VarRead(file.get(), "samples"),
                                                               Mat_VarFree);
  ASSERT_TRUE(samples);
  ASSERT_EQ(samples->dims[0], static_cast<std::size_t>(kRows));
  ASSERT_EQ(samples->dims[1], 3U);
  EXPECT_EQ(std::memcmp(samples->data, recording.samples.data(), sizeof(double) * kRows * 3), 0);
}

TEST_F(Exchange, MatIsReadByScipy) {
  ASSERT_TRUE(exchange::export_mat(sample_recording(), folder_ / "r.mat").ok());
  ASSERT_TRUE(exchange::export_mat(sample_recording(0), folder_ / "empty.mat").ok());
  expect_ok("scipy", R"(
import math, scipy.io
m = scipy.io.loadmat("r.mat", squeeze_me=True)
assert m["samples"].shape == (20000, 3) and m["samples"][3, 1] == math.cos(0.003)
assert m["t_ns"].dtype == "int64" and m["t_ns"][2] == 2000000
assert list(m["channels"]["name"]) == ["truth.elbow", "jpos.elbow", "runlevel"]
assert list(m["channels"]["role"])[1] == "joint_estimate"
assert dict(zip(m["meta"]["key"], m["meta"]["value"]))["clock.realtime_minus_monotonic_ns"] == "42"
assert m["events"]["kind"][1] == "edges_lost" and int(m["events"]["t_ns"][0]) == 5000000
assert m["events"]["detail"][1] == "elbow \u00b5"
assert scipy.io.loadmat("empty.mat")["samples"].shape == (0, 3)
print("ok"))");
}

void expect_same(const record::Recording& read, const record::Recording& given) {
  EXPECT_EQ(read.meta, given.meta);
  EXPECT_EQ(read.t_ns, given.t_ns);
  ASSERT_EQ(read.channels.size(), given.channels.size());
  for (std::size_t c = 0; c < given.channels.size(); ++c) {
    EXPECT_EQ(read.channels[c].name, given.channels[c].name);
    EXPECT_EQ(read.channels[c].unit, given.channels[c].unit);
    EXPECT_EQ(read.channels[c].role, given.channels[c].role);
    EXPECT_EQ(read.channels[c].joint, given.channels[c].joint);
  }
  ASSERT_EQ(read.rows(), given.rows());
  EXPECT_EQ(std::memcmp(read.samples.data(), given.samples.data(),
                        sizeof(double) * static_cast<std::size_t>(given.samples.size())),
            0);
  ASSERT_EQ(read.events.size(), given.events.size());
  for (std::size_t e = 0; e < given.events.size(); ++e) {
    EXPECT_EQ(read.events[e].t_ns, given.events[e].t_ns);
    EXPECT_EQ(read.events[e].kind, given.events[e].kind);
    EXPECT_EQ(read.events[e].detail, given.events[e].detail);
  }
}

TEST_F(Exchange, AnExportIsReadAsTheRecordingThatItWas) {
  record::Recording recording = sample_recording();
  // Nanoseconds since 1970, which no double holds.
  for (std::int64_t& t_ns : recording.t_ns) t_ns += 1'700'000'000'123'456'789;
  recording.channels[1].joint = "";
  ASSERT_TRUE(exchange::export_hdf5(recording, folder_ / "r.h5").ok());
  ASSERT_TRUE(exchange::export_mat(recording, folder_ / "r.mat").ok());
  const record::Recording bare = sample_recording(3);
  ASSERT_TRUE(exchange::export_hdf5(bare, folder_ / "bare.h5").ok());
  ASSERT_TRUE(exchange::export_mat(bare, folder_ / "bare.mat").ok());
  for (const char* kind : {"h5", "mat"}) {
    SCOPED_TRACE(kind);
    const auto read = exchange::load_recording(folder_ / fmt::format("r.{}", kind), {});
    ASSERT_TRUE(read.ok()) << read.error().message;
    expect_same(*read, recording);
    record::LoadOptions options;
    options.range = {0.0, 1.5e-3};
    const auto part = exchange::load_recording(folder_ / fmt::format("bare.{}", kind), options);
    ASSERT_TRUE(part.ok()) << part.error().message;
    EXPECT_EQ(part->rows(), 2);
  }
}

TEST_F(Exchange, AnExportIsImportedWithoutAProfile) {
  ASSERT_TRUE(record::write_recording(sample_recording(), folder_ / "r.db").ok());
  for (const char* kind : {"h5", "mat"}) {
    const Outcome out =
        run(fmt::format("'{0}' export r.db --out r.{1} && '{0}' import r.{1} --out "
                        "{1}.db && '{0}' export {1}.db --out {1}.csv",
                        RAVENCAL_PROGRAM, kind));
    ASSERT_EQ(out.exit_code, 0) << out.text;
  }
  ASSERT_EQ(run(fmt::format("'{}' export r.db --out r.csv", RAVENCAL_PROGRAM)).exit_code, 0);
  for (const char* kind : {"h5", "mat"}) {
    EXPECT_EQ(run(fmt::format("cmp r.csv {0}.csv && cmp r.csv.toml {0}.csv.toml", kind)).text, "");
  }
}

TEST_F(Exchange, NothingIsLeftWhereItCannotWrite) {
  const fs::path missing = folder_ / "none/r.h5";
  EXPECT_EQ(exchange::export_hdf5(sample_recording(), missing).error().code, core::ErrorCode::kIo);
  EXPECT_EQ(exchange::export_mat(sample_recording(), folder_ / "none/r.mat").error().code,
            core::ErrorCode::kIo);
  // A disk of 64 KiB, by way of the shell's limit of file sizes, which counts in KiB.
  ASSERT_TRUE(record::write_recording(sample_recording(), folder_ / "r.db").ok());
  const auto files = [&] { return std::distance(fs::directory_iterator(folder_), {}); };
  const auto files_before = files();
  for (const char* name : {"full.h5", "full.mat"}) {
    const Outcome outcome = run(fmt::format(
        "(trap '' XFSZ; ulimit -f 64; '{}' export r.db --out {})", RAVENCAL_PROGRAM, name));
    EXPECT_EQ(outcome.exit_code, 3) << outcome.text;
    EXPECT_NE(outcome.text.find("is the disk full"), std::string::npos) << outcome.text;
    EXPECT_EQ(files(), files_before) << name;
  }
}

TEST_F(Exchange, TheCommandWritesEachKindAndNamesWhatItCannot) {
  ASSERT_TRUE(record::write_recording(sample_recording(), folder_ / "r.db").ok());
  for (const char* name : {"r.h5", "r.mat", "r.csv"}) {
    const Outcome outcome = run(fmt::format("'{}' export r.db --out {}", RAVENCAL_PROGRAM, name));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
    EXPECT_EQ(outcome.text, fmt::format("{}: {} rows\n", name, kRows));
  }
  EXPECT_EQ(run(fmt::format("'{}' export r.db --out r.xls", RAVENCAL_PROGRAM)).exit_code, 2);
  const Outcome needless =
      run(fmt::format("'{}' export r.db --out again.mat --profile raven2", RAVENCAL_PROGRAM));
  EXPECT_EQ(needless.exit_code, 2);
  EXPECT_NE(needless.text.find("need no --profile"), std::string::npos) << needless.text;
}

// PlotJuggler: one header line of unique names, the time as a column of its own, points and commas.
// HDF5 stamps its objects with the time in seconds unless it is told otherwise.
TEST_F(Exchange, OneRecordingGivesTheSameBytesASecondLater) {
  const record::Recording recording = sample_recording();
  ASSERT_TRUE(exchange::export_hdf5(recording, folder_ / "now.h5").ok());
  ASSERT_TRUE(exchange::export_mat(recording, folder_ / "now.mat").ok());
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  ASSERT_TRUE(exchange::export_hdf5(recording, folder_ / "later.h5").ok());
  ASSERT_TRUE(exchange::export_mat(recording, folder_ / "later.mat").ok());
  for (const char* kind : {"h5", "mat"})
    EXPECT_EQ(run(fmt::format("cmp now.{0} later.{0}", kind)).text, "") << kind;
}

TEST_F(Exchange, PlottersReadTheCsvByItsHeader) {
  ASSERT_TRUE(record::write_recording(sample_recording(), folder_ / "r.db").ok());
  ASSERT_EQ(run(fmt::format("'{}' export r.db --out r.csv", RAVENCAL_PROGRAM)).exit_code, 0);
  std::ifstream file(folder_ / "r.csv");
  std::string header;
  std::string first;
  std::getline(file, header);
  std::getline(file, first);
  EXPECT_EQ(header, "t_s,truth.elbow_rad,jpos.elbow_rad,runlevel_1");
  EXPECT_EQ(first, "0.000000000,0,1,0");
}

// As dnn_model_multi_attempt_scaled.ipynb takes its table: no header, 252 columns of numbers,
// truths in 1 to 3, inputs 12 to 251 without encVals and encoffsets: 208.
TEST_F(Exchange, TheAuthorsNotebookReadsTheCsvUnchanged) {
  const record::Recording recording = robot_recording();
  ASSERT_TRUE(record::write_recording(recording, folder_ / "r.db").ok());
  const Outcome outcome =
      run(fmt::format("'{}' export r.db --profile raven2 --out r.csv", RAVENCAL_PROGRAM));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  expect_ok("numpy", fmt::format(R"(
import numpy as np
data = np.loadtxt("r.csv", delimiter=",")
assert data.shape == (40, 252), data.shape
features = [c for c in range(12, 252) if not 82 <= c <= 97 and not 212 <= c <= 227]
assert len(features) == 208 and np.isfinite(data[:, features]).all()
assert abs(data[3, 1] - {:.17g}) < 1e-12                       # truth, rad
assert abs(np.radians(data[3, 13]) - {:.17g}) < 1e-12          # jpos, deg
print("ok"))",
                                 recording.samples(3, 0),
                                 recording.samples(3, *recording.column("jpos.shoulder"))));
}

TEST_F(Exchange, TheShellOpensARecording) {
  ASSERT_TRUE(record::write_recording(sample_recording(), folder_ / "r.db").ok());
  if (run("command -v sqlite3").exit_code != 0) GTEST_SKIP() << "sqlite3 is not installed";
  EXPECT_EQ(run("sqlite3 r.db 'select count(*), max(t_ns) from sample'").text,
            "20000|19999000000\n");
  EXPECT_EQ(run("sqlite3 r.db 'select unit, role from channel where name = \"jpos.elbow\"'").text,
            "rad|joint_estimate\n");
  EXPECT_EQ(run("sqlite3 r.db 'select kind from event order by t_ns'").text,
            "homing\nedges_lost\n");
}

}  // namespace
}  // namespace ravencal::test
