// SPDX-License-Identifier: Apache-2.0
//
// The usual mistakes with files of other programs: what the message says of each.
#include "core/whole_file.hpp"
#include "exchange/hdf5_export.hpp"
#include "exchange/mat_export.hpp"
#include "unit/exchange_rig.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

const fs::path kGolden = fs::path(RAVENCAL_SOURCE_DIR) / "tests/golden";

struct Mistake {
  std::string file;
  std::string profile;             ///< text of a profile file, or the name of a built-in one
  std::vector<std::string> words;  ///< that the message has, besides the file's name
};

class ExchangeErrors : public ExchangeRig {
 protected:
  /// A profile of one channel from that column, with time column t.
  static std::string of(const std::string& column, const std::string& source = "time = 't'") {
    return fmt::format("[source]\n{}\n[[channel]]\nname = 'q'\ncolumn = '{}'\nunit = 'rad'\n",
                       source, column);
  }
  void copy(const fs::path& from, const std::string& to) const {
    fs::copy_file(from, folder_ / to, fs::copy_options::overwrite_existing);
  }
  void cut(const fs::path& from, const std::string& to, double share) const {
    const auto bytes = core::read_whole_file(from);
    ASSERT_TRUE(bytes.ok()) << bytes.error().message;
    write(to,
          bytes->substr(0, static_cast<std::size_t>(share * static_cast<double>(bytes->size()))));
  }
  void expect(const std::vector<Mistake>& mistakes) const {
    for (const Mistake& mistake : mistakes) {
      SCOPED_TRACE(mistake.file);
      record::LoadOptions options;
      options.profile = mistake.profile.find('[') == std::string::npos
                            ? mistake.profile
                            : write("p.toml", mistake.profile).string();
      const fs::path path = folder_ / mistake.file;
      const auto read = exchange::load_recording(path, options);
      ASSERT_FALSE(read.ok());
      const std::string& message = read.error().message;
      EXPECT_TRUE(message.starts_with(path.string() + ":")) << message;
      for (const std::string& word : mistake.words)
        EXPECT_NE(message.find(word), std::string::npos) << message << "\nwanted: " << word;
    }
  }
};

TEST_F(ExchangeErrors, OfFilesThatAreNoneSayWhichThereAre) {
  fs::create_directory(folder_ / "bag");
  write("run.txt", "x");
  write("run.MCAP", "x");
  write("run.db3.zstd", "x");
  write("p.csv", "t,q\n0,1\n");
  const std::vector<std::string> kinds = {"csv", "npz", "npy", "mat", "h5", "mcap", "db3"};
  std::vector<Mistake> mistakes = {
      {"run.txt", "generic", {"'.txt'", "known: .csv, .npz"}},
      {"run.MCAP", "generic", {"did you mean '.mcap'?"}},
      {"run.db3.zstd", "generic", {"compressed as a whole", "zstd -d"}},
      {"bag", "generic", {"is a folder", ".mcap or .db3"}},
      {"p.csv", "", {"a .csv needs --profile", "`ravencal info` lists its columns"}},
      {"p.csv", "raven2-bag", {"profile raven2-bag is for .bag files"}},
  };
  for (const std::string& kind : kinds) {
    write("empty." + kind, "");
    mistakes.push_back({"empty." + kind, "generic", {"the file is empty"}});
    mistakes.push_back({"absent." + kind, "generic", {"cannot open", "No such file"}});
  }
  expect(mistakes);
}

TEST_F(ExchangeErrors, OfRenamedAndCutFilesSayWhatWasExpected) {
  record::Recording recording;
  recording.channels = {{"q", "rad", record::Role::kFeature, ""}};
  recording.t_ns = {0, 1, 2};
  recording.samples = record::SampleMatrix::Zero(3, 1);
  ASSERT_TRUE(exchange::export_hdf5(recording, folder_ / "whole.h5").ok());
  ASSERT_TRUE(exchange::export_mat(recording, folder_ / "whole.mat").ok());
  cut(folder_ / "whole.h5", "cut.h5", 0.5);
  cut(folder_ / "whole.mat", "cut.mat", 0.5);
  cut(kGolden / "models/scaling_compressed.npz", "cut.npz", 0.5);
  cut(kGolden / "ros2/joint_states_lz4.mcap", "cut.mcap", 0.5);
  cut(kGolden / "ros2/joint_states.db3", "cut.db3", 0.5);
  copy(folder_ / "whole.h5", "renamed.npz");
  copy(folder_ / "whole.mat", "renamed.h5");
  copy(folder_ / "whole.h5", "renamed.mcap");
  copy(kGolden / "record/v1.db", "renamed.db3");
  write("renamed.npy", "t,q\n0,1\n");
  write("renamed.mat", "t,q\n0,1\n");
  expect({
      {"cut.h5", "", {"not a whole HDF5 file", "cut short"}},
      {"cut.mat", "generic", {"the variable at byte ", "is cut short"}},
      {"cut.npz", "generic", {"not a whole .npz file", "cut short"}},
      {"cut.mcap", "generic", {"ends without a footer, in the record at byte ", "--skip-bad"}},
      {"cut.db3", "generic", {"malformed"}},
      {"renamed.npz", "generic", {"not a whole .npz file"}},
      {"renamed.npy", "generic", {"does not begin as numpy writes it"}},
      {"renamed.h5", "", {"not a whole HDF5 file", "renamed?"}},
      {"renamed.mat", "", {"not a whole MAT-file", "renamed?"}},
      {"renamed.mcap", "generic", {"does not begin as an MCAP file does", "renamed"}},
      {"renamed.db3", "generic", {"no table 'messages'", "called .db"}},
  });
}

TEST_F(ExchangeErrors, OfColumnsSayWhichThereAreAndWhatIsWrong) {
  if (!python("numpy", R"(
t = np.arange(4.0)
np.savez("a.npz", t=t, position=t, short=t[:3], nan=np.where(t == 2, np.nan, t), word=np.array(list("xyxy")),
         back=t[::-1], cube=np.zeros((4, 2, 2)), wide=np.zeros((2, 4000)), z=t + 1j, none=np.zeros((0,)))
np.savez("many.npz", **{f"column_{i}": t for i in range(60)})
np.save("one.npy", np.zeros((4, 2)))
)"))
    GTEST_SKIP() << "/usr/bin/python3 has no numpy";
  expect({
      {"a.npz", of("positon"), {"no column 'positon'", "did you mean 'position'?", "known: t, "}},
      {"a.npz", of("position", "time = 'time'"), {"no column 'time', which profile p needs"}},
      {"many.npz",
       of("column_7x", "time = 'column_1'"),
       {"did you mean 'column_7'?", "lists the 60"}},
      {"a.npz", of("short"), {"'t' has 4 values and 'short' has 3", "of one length"}},
      {"a.npz", of("nan"), {"row 2: column 'nan' (q): 'nan' is not a number", "--skip-bad"}},
      {"a.npz", of("word"), {"row 0: column 'word' (q): 'x' is not a number"}},
      {"a.npz", of("position", "time = 'back'"), {"row 1: time runs backwards, from 3 s to 2 s"}},
      {"a.npz", of("cube"), {"'cube' cannot be a column: its shape is 4 x 2 x 2"}},
      {"a.npz", of("wide"), {"2 x 4000", "transpose it"}},
      {"a.npz", of("z"), {"its type is <c16", "astype"}},
      {"a.npz", of("none", "time = 'none'"), {"no rows"}},
      {"a.npz", "generic", {"column 1 ('t'): unknown unit", "_UNIT"}},
      {"one.npy",
       "[source]\nheader = false\n[[channel]]\nname = 'q'\nindex = 5\nunit = 'rad'\n",
       {"2 columns, but profile p reads column 6"}},
  });
}

TEST_F(ExchangeErrors, OfNumpyFilesWithAWrongByteNameTheEntry) {
  if (!python("numpy", "np.savez('whole.npz', t=np.arange(500.0), q=np.arange(500.0))\n"))
    GTEST_SKIP() << "/usr/bin/python3 has no numpy";
  auto bytes = *core::read_whole_file(folder_ / "whole.npz");
  bytes[2000] = static_cast<char>(bytes[2000] ^ 1);
  write("hurt.npz", bytes);
  expect({{"hurt.npz", of("q"), {"entry 0 of the archive cannot be read"}}});
}

/// matio itself reads on, and gives numbers that are in no file.
TEST_F(ExchangeErrors, OfMatFilesThatAreCutOrDamagedSayWhere) {
  if (!python("scipy.io", R"(
import scipy.io
t = np.arange(500.0)
scipy.io.savemat("plain.mat", {"t": t, "q": np.sin(t)})
scipy.io.savemat("packed.mat", {"t": t, "q": np.sin(t)}, do_compression=True)
)"))
    GTEST_SKIP() << "/usr/bin/python3 has no scipy";
  for (const char* name : {"plain.mat", "packed.mat"}) {
    const auto whole = core::read_whole_file(folder_ / name);
    ASSERT_TRUE(whole.ok());
    ASSERT_TRUE(load(name, of("q")).ok());
    for (std::size_t size = 150; size < whole->size(); size += 37) {
      write("cut.mat", whole->substr(0, size));
      const auto read = load("cut.mat", of("q"));
      EXPECT_FALSE(read.ok()) << size;
    }
  }
  auto damaged = *core::read_whole_file(folder_ / "packed.mat");
  damaged[damaged.size() - 40] = static_cast<char>(damaged[damaged.size() - 40] ^ 1);
  write("hurt.mat", damaged);
  expect({{"hurt.mat", of("q"), {"the variable at byte ", "is damaged"}}});
}

TEST_F(ExchangeErrors, OfBagsSayWhichTopicsThereAre) {
  copy(kGolden / "ros2/joint_states_zstd.mcap", "a.mcap");
  copy(kGolden / "ros2/joint_states.db3", "a.db3");
  copy(kGolden / "ros2/joint_states.db3", "other.db3");
  ASSERT_EQ(run_command(fmt::format("cd '{}' && /usr/bin/python3 -c \"import sqlite3; c = "
                                    "sqlite3.connect('other.db3'); c.execute('UPDATE topics SET "
                                    "type = \\'std_msgs/msg/Float64\\''); c.commit()\"",
                                    folder_.string()))
                .exit_code,
            0);
  expect({
      {"a.mcap", of("/note", ""), {"'/note' cannot be a column", "std_msgs/msg/String"}},
      {"a.mcap",
       of("/joint_states/elbow/positions", ""),
       {"did you mean '/joint_states/elbow/position'?", "/encoders/shoulder/effort"}},
      {"a.db3", of("/joint_states/elbow/effort", ""), {"no column '/joint_states/elbow/effort'"}},
      {"a.db3",
       of("/encoders/shoulder/position", ""),
       {"row 0: column '/encoders/shoulder/position' (q): 'nan' is not a number"}},
      {"other.db3",
       of("/x", ""),
       {"no message of sensor_msgs/msg/JointState", "/encoders (std_msgs/msg/Float64)"}},
  });
}

}  // namespace
}  // namespace ravencal::test
