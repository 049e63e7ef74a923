// SPDX-License-Identifier: Apache-2.0
//
// The ways in which programs write a table as text: each is the same table, or is named.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "record/csv_load.hpp"
#include "record/load.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;
using Columns = std::vector<std::vector<double>>;

std::string utf16(std::string_view ascii, bool big_endian) {
  std::string text;
  for (const char c : ascii) text += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
  return text;
}

TEST(CsvDialect, EveryWayToWriteATableIsTheSameTable) {
  const std::string plain = "t_s,a,b\n0,-1.25,3\n0.5,2.5e-1,4\n1.5,7.125,-5\n";
  const std::string tabs = "t_s\ta\tb\n0\t-1.25\t3\n0.5\t2.5e-1\t4\n1.5\t7.125\t-5\n";
  const std::string ways[] = {
      plain,
      tabs,
      "t_s;a;b\n0;-1.25;3\n0.5;2.5e-1;4\n1.5;7.125;-5\n",
      "t_s;a;b\n0;-1,25;3\n0,5;2,5e-1;4\n1,5;7,125;-5\n",
      "t_s;a;b\r\n0;-1,25;3\r\n0,5;2,5e-1;4\r\n1,5;7,125;-5\r\n\r\n",
      "t_s\ta\tb\n0\t-1,25\t3\n0,5\t2,5e-1\t4\n1,5\t7,125\t-5",
      "t_s a b\n0 -1.25 3\n0.5 2.5e-1 4\n1.5 7.125 -5\n",
      "# t_s a b\n0 -1.25 3\n0.5 2.5e-1 4\n1.5 7.125 -5\n",
      "  t_s     a  b \n  0   -1.25  3\n  0.5  2.5e-1 4 \n\t1.5  7.125  -5\n",
      "t_s a b\n0 -1,25 3\n0,5 2,5e-1 4\n1,5 7,125 -5\n",
      "\"t_s\";\"a\";\"b\"\n\"0\";\"-1,25\";\"3\"\n\"0,5\";\"2,5e-1\";\"4\"\n\"1,5\";\"7,125\";-"
      "5\n",
      "\"t_s\",\"a\",\"b\"\n0,\"-1,25\",3\n\"0,5\",\"2,5e-1\",4\n\"1,5\",\"7,125\",-5\n",
      "\xEF\xBB\xBF" + plain,
      "\xEF\xBB\xBFt_s;a;b\n0;-1,25;3\n0,5;2,5e-1;4\n1,5;7,125;-5\n",
      "\xFF\xFE" + utf16(plain, false),
      "\xFE\xFF" + utf16(tabs, true),
      utf16(plain, false),
      "t_s,a,b\r0,-1.25,3\r0.5,2.5e-1,4\r1.5,7.125,-5\r",
  };
  const Scratch scratch;
  for (const std::string& text : ways) {
    const auto table = read_csv_table(scratch.write("a.csv", text), {});
    ASSERT_TRUE(table.ok()) << table.error().message << " of\n" << text;
    ASSERT_EQ(table->columns.size(), 3U) << text;
    Columns values;
    for (const TableColumn& column : table->columns) values.push_back(column.values);
    EXPECT_EQ(values, (Columns{{0, 0.5, 1.5}, {-1.25, 0.25, 7.125}, {3, 4, -5}})) << text;
    EXPECT_EQ(table->columns[0].name, "t_s") << text;
    EXPECT_EQ(table->columns[2].name, "b") << text;
  }
}

TEST(CsvDialect, ATableWithoutHeaderIsReadInEveryDialect) {
  const Scratch scratch;
  for (const char* text : {"0.5,1.5\n2.5,-3.5\n", "0,5;1,5\n2,5;-3,5\n", "0.5\t1.5\n2.5\t-3.5\n",
                           "0.5  1.5\n2.5 -3.5\n", "0,5 1,5\n2,5 -3,5\n",
                           "\xEF\xBB\xBF"
                           "0.5,1.5\n2.5,-3.5\n"}) {
    const auto table = read_csv_table(scratch.write("a.csv", text), {});
    ASSERT_TRUE(table.ok()) << table.error().message;
    EXPECT_FALSE(table->has_header) << text;
    ASSERT_EQ(table->columns.size(), 2U) << text;
    EXPECT_EQ(table->columns[1].values, (std::vector<double>{1.5, -3.5})) << text;
  }
}

TEST(CsvDialect, QuotesHoldSeparatorsInNamesAndTexts) {
  const Scratch scratch;
  for (const char* text : {"t,\"q, left\",mode\n0,1.5,\"a, \"\"b\"\"\"\n1,2.5,c\n",
                           "t;q, left;mode\n0,0;1,5;a, \"b\"\n1,0;2,5;c\n"}) {
    const auto table = read_csv_table(scratch.write("a.csv", text), {});
    ASSERT_TRUE(table.ok()) << table.error().message;
    ASSERT_EQ(table->columns.size(), 3U) << text;
    EXPECT_EQ(table->columns[1].name, "q, left") << text;
    EXPECT_EQ(table->columns[1].values, (std::vector<double>{1.5, 2.5})) << text;
    EXPECT_EQ(table->columns[2].texts, (std::vector<std::string>{"a, \"b\"", "c"})) << text;
  }
  // Only behind the lines that decide on the dialect.
  std::string text = "t,q,mode\n";
  for (int i = 0; i < 100; ++i) text += fmt::format("{},1,x\n", i);
  const auto late = read_csv_table(scratch.write("a.csv", text + "100,2,\"y, z\"\n"), {});
  ASSERT_TRUE(late.ok()) << late.error().message;
  EXPECT_EQ(late->columns[2].texts.back(), "y, z");
  EXPECT_EQ(late->columns[1].values.back(), 2.0);
}

TEST(CsvDialect, NamesThatAreNoUtf8BecomeIt) {
  const Scratch scratch;
  const auto table = read_csv_table(scratch.write("a.csv", "t,q [\xB0]\n0,1\n1,2\n"), {});
  ASSERT_TRUE(table.ok()) << table.error().message;
  EXPECT_EQ(table->columns[1].name, "q [\xC2\xB0]");
  const std::string wide(
      "\xFF\xFEt\0,\0\xB0\0=\xD8\x00\xDE\n\0"
      "0\0,\0"
      "1\0",
      22);
  const auto utf = read_csv_table(scratch.write("b.csv", wide), {});
  ASSERT_TRUE(utf.ok()) << utf.error().message;
  EXPECT_EQ(utf->columns[1].name, "\xC2\xB0\xF0\x9F\x98\x80");
}

TEST(CsvDialect, AProfileBindsItsColumnsInEveryDialect) {
  const Scratch scratch;
  LoadOptions options;
  options.profile = scratch
                        .write("p.toml",
                               "[source]\ntime = 't'\n[[channel]]\nname = 'q'\n"
                               "column = 'q, left'\nunit = 'deg'\n")
                        .string();
  for (const char* text : {"t,\"q, left\"\n0,1.5\n1,2.5\n", "t;\"q, left\"\n0,0;1,5\n1,0;2,5\n",
                           "t \"q, left\"\n0 1.5\n1 2.5\n"}) {
    const auto loaded = load_recording(scratch.write("a.csv", text), options);
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    EXPECT_DOUBLE_EQ(loaded->samples(1, 0), 2.5 * 3.14159265358979323846 / 180.0) << text;
  }
}

TEST(CsvDialect, ErrorsKeepTheLinesColumnsAndValuesOfTheFile) {
  struct WrongDialect {
    std::string text, complaint;
  };
  const std::string remedy = "; use --skip-bad to drop such rows";
  const WrongDialect cases[] = {
      {"t_s;a_1\n0;1,5\n\n1,5;2\n", ":3: the line is empty" + remedy},
      {"t_s;a_1\n0;1,5\n1;1,5;2\n", ":3: 3 columns where 2 are needed" + remedy},
      {"t_s a_1\n0 1.5\n1  x\n", ":3: column 2 (a): 'x' is not a number" + remedy},
      {"t_s;a_1\n0;1,5\n1;1,2,3\n", ":3: column 2 (a): '1,2,3' is not a number" + remedy},
      {"t_s\ta_1\n0\t1.5\n1\t\n", ":3: column 2 (a): the field is empty" + remedy},
      {"t_s,a_1\n0,1.5\n1,\"2\n", ":3: column 2: the quotes do not end on the line" + remedy},
      {"t_s;a_1\n0;1,5\n1;\"2\n", ":3: column 2: the quotes do not end on the line" + remedy},
      {"t_s,\"a_1\n0,1.5\n1,2\n", ":1: column 2: the quotes do not end on the line"},
      {"t_s;a_1\n0;1,5\n1;2.5\n",
       ":3: column 2: '2.5' has a decimal point, and '1,5' in line 2, column 2 a decimal comma; "
       "write all numbers with one decimal sign"},
      {"t_s;a_1\n0.5;1\n1;2,5\n",
       ":3: column 2: '2,5' has a decimal comma, and '0.5' in line 2, column 1 a decimal point; "
       "write all numbers with one decimal sign"},
      {"t_s\ta_1\n0\t1,500\n1\t2,750\n",
       ":2: column 2: '1,500' may be 1.500 or a number with a comma at its thousands, and no "
       "number of the file says which; write decimal points"},
      {"t_s,a_1\n0,5,1,25\n1,5,2,75\n",
       ":2: 4 numbers separated by ',', where line 1 has 2 so separated ('t_s,a_1'); line 1 must "
       "name every column, with the rows' separator, and where decimal signs are commas the "
       "separator must be another, such as ';'"},
      {"t_s;a_1\n0,1\n1,2\n", ":2: 2 numbers separated by ',', where line 1 has 1 so separated"},
      {"time (s) pos (rad)\n0.5 1\n1 2\n", ":2: 2 numbers separated by blanks, where line 1 has 4"},
      {"t;pos, rad\n0;1,5\n1;2,5\n",
       ":1: can be read as 2 columns separated by ';' or as 2 separated by ','; put names that "
       "hold a separator in quotes"},
      {std::string("\xFF\xFE\0\0t\0\0\0", 8), ": is text in UTF-32; save it as UTF-8"},
      {"\xFF\xFE" + utf16("t_s,a_1\n0,1\n", false) + "\n",
       ": byte 24 is half a character of UTF-16; save the file as UTF-8"},
      {"\xFF\xFE", ": the file is empty"},
  };
  const Scratch scratch;
  LoadOptions options;
  options.profile = "generic";
  for (const WrongDialect& c : cases) {
    const auto path = scratch.write("run7.csv", c.text);
    const auto loaded = load_recording(path, options);
    const std::string error = loaded.ok() ? "no error" : loaded.error().message;
    EXPECT_TRUE(error.starts_with(path.string() + c.complaint)) << error << " of\n" << c.text;
  }
}

TEST(CsvDialect, BadRowsLeaveWithTheirLineInEveryDialect) {
  const Scratch scratch;
  LoadOptions options;
  options.profile = "generic";
  options.skip_bad = true;
  const auto loaded =
      load_recording(scratch.write("a.csv", "t_s;a_1\n0;1,5\nx;2\n2;\"3\n3;4,5\n"), options);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded->rows(), 2);
  ASSERT_EQ(loaded->events.size(), 2U);
  EXPECT_EQ(loaded->events[0].detail, "line 3: column 1 (time): 'x' is not a number");
}

TEST(ColumnsOfOneName, AreRefusedWithTheirNumbers) {
  const Scratch scratch;
  const auto path = scratch.write("a.csv", "t,q_rad,p,q_rad\n0,1,2,3\n1,4,5,6\n");
  const std::string complaint = path.string() + ":1: columns 2 and 4 are both called 'q_rad'; ";
  const auto table = read_csv_table(path, {});
  ASSERT_FALSE(table.ok());
  EXPECT_TRUE(table.error().message.starts_with(complaint)) << table.error().message;
  const std::string source = "[source]\ntime = 't'\n[[channel]]\nname = 'q'\nunit = 'rad'\n";
  LoadOptions options;
  options.profile = scratch.write("p.toml", source + "column = 'q_rad'\n").string();
  const auto by_name = load_recording(path, options);
  ASSERT_FALSE(by_name.ok());
  EXPECT_TRUE(by_name.error().message.starts_with(complaint)) << by_name.error().message;
  options.profile = scratch.write("p.toml", source + "index = 3\n").string();
  const auto by_index = load_recording(path, options);
  ASSERT_TRUE(by_index.ok()) << by_index.error().message;
  EXPECT_EQ(by_index->samples(1, 0), 6.0);
  options.profile = scratch
                        .write("p.toml",
                               "[source]\ntime = 't'\n[[channel]]\nname = 'p'\n"
                               "unit = 'rad'\ncolumn = 'p'\n")
                        .string();
  EXPECT_TRUE(load_recording(path, options).ok()) << "nobody asks for the two";
  options.profile = "generic";
  const auto generic =
      load_recording(scratch.write("b.csv", "t_s,a_rad,b_rad,a_rad\n0,1,2,3\n"), options);
  ASSERT_FALSE(generic.ok());
  EXPECT_NE(generic.error().message.find("columns 2 and 4"), std::string::npos)
      << generic.error().message;
}

TEST(RelativeChannel, CountsFromItsFirstValueThatIsThere) {
  const Scratch scratch;
  LoadOptions options;
  options.profile =
      scratch
          .write("p.toml",
                 "[source]\ntime = 't'\n[[channel]]\nname = 'q'\ncolumn = 'q'\nunit = 'm'\n"
                 "relative = true\nmay_be_missing = true\n[[channel]]\nname = 'lost'\n"
                 "column = 'lost'\nunit = 'm'\nrelative = true\nmay_be_missing = true\n")
          .string();
  const auto loaded =
      load_recording(scratch.write("a.csv", "t,q,lost\n0,,\n1,nan,\n2,4.5,\n3,,\n4,6,\n"), options);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_TRUE(std::isnan(loaded->samples(0, 0)));
  EXPECT_EQ(loaded->samples(2, 0), 0.0);
  EXPECT_EQ(loaded->samples(4, 0), 1.5);
  EXPECT_EQ(loaded->meta.at("origin.q"), "4.5");
  EXPECT_FALSE(loaded->meta.contains("origin.lost"));
}

}  // namespace
}  // namespace ravencal::record
