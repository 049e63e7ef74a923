// SPDX-License-Identifier: Apache-2.0
#include "core/toml_table.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

namespace ravencal::core {
namespace {

TomlTable parsed(std::string_view text) {
  auto table = parse_toml(text, "f.toml", "a file");
  EXPECT_TRUE(table.ok()) << table.error().message;
  return std::move(table).value();
}

std::string complaint(std::string_view text, const std::function<void(TomlTable&)>& read) {
  TomlTable table = parsed(text);
  read(table);
  const Status status = table.finish();
  return status.ok() ? "" : status.error().message;
}

TEST(TomlTable, GivesValuesAndFallbacks) {
  TomlTable table = parsed(
      "x = 1.5\ni = 3\nb = true\nt = 'word'\nlist = [1, 2.5]\nm = [[1, 2], [3, 4]]\nw = ['a', 7]\n"
      "[inner]\ny = 2\n[[row]]\nk = 1\n[[row]]\nk = 2\n");
  EXPECT_DOUBLE_EQ(table.number("x"), 1.5);
  EXPECT_DOUBLE_EQ(table.number("i"), 3.0);
  EXPECT_EQ(table.find_integer("i"), 3);
  EXPECT_DOUBLE_EQ(table.number_or("z", 9.0), 9.0);
  EXPECT_FALSE(table.find_number("z").has_value());
  EXPECT_EQ(table.integer_or("n", -4), -4);
  EXPECT_TRUE(table.boolean_or("b", false));
  EXPECT_TRUE(table.boolean_or("c", true));
  EXPECT_EQ(table.text("t"), "word");
  EXPECT_EQ(table.text_or("u", "other"), "other");
  EXPECT_TRUE(table.holds_text("t"));
  EXPECT_FALSE(table.holds_integer("x"));
  EXPECT_EQ(table.numbers("list", 2), (std::vector{1.0, 2.5}));
  EXPECT_EQ(table.matrix("m", 2), (std::vector{std::vector{1.0, 2.0}, std::vector{3.0, 4.0}}));
  EXPECT_EQ(table.words("w"), (std::vector<std::string>{"a", "7"}));
  EXPECT_DOUBLE_EQ(table.table("inner")->number("y"), 2.0);
  EXPECT_EQ(table.tables("row").at(1).find_integer("k"), 2);
  EXPECT_TRUE(table.tables("none").empty());
  EXPECT_TRUE(table.finish().ok()) << table.finish().error().message;
}

TEST(TomlTable, NamesLineColumnAndTheKnownKeysOfAKeyThatNobodyReads) {
  EXPECT_EQ(complaint("x = 1\n  y = 2\n", [](TomlTable& table) { (void)table.number("x"); }),
            "f.toml:2: unknown key 'y' in a file; known: x (column 7)");
}

TEST(TomlTable, NamesTheTableThatLacksAKey) {
  TomlTable root = parsed("\n[[joint]]\n[joint.link]\n");
  std::vector<TomlTable> joints = root.tables("joint");
  auto link = joints.at(0).table("link");
  (void)link->number("mass_kg");
  EXPECT_EQ(link->finish().error().message,
            "f.toml:3: mass_kg is missing in [joint.link] (column 1)");
  (void)joints[0].text("name");
  EXPECT_EQ(joints[0].finish().error().message,
            "f.toml:2: name is missing in [[joint]] (column 1)");
}

TEST(TomlTable, RefusesEveryWrongTypeAndValue) {
  struct Case {
    std::string text;
    std::function<void(TomlTable&)> read;
    std::string why;
  };
  const std::vector<Case> cases = {
      {"x = true", [](auto& t) { (void)t.number("x"); }, "x must be a finite number"},
      {"x = 'a'", [](auto& t) { (void)t.number_or("x", 1); }, "x must be a finite number"},
      {"x = inf", [](auto& t) { (void)t.number("x"); }, "x must be a finite number"},
      {"x = nan", [](auto& t) { (void)t.find_number("x"); }, "x must be a finite number"},
      {"x = 2",
       [](auto& t) {
         (void)t.number("x", {0, 1});
       },
       "x is 2, must be from 0 to 1"},
      {"i = 1.0", [](auto& t) { (void)t.find_integer("i"); }, "i must be a whole number ("},
      {"i = -1",
       [](auto& t) {
         (void)t.integer_or("i", 0, {0, 5});
       },
       "i must be a whole number from 0 to 5"},
      {"b = 1", [](auto& t) { (void)t.boolean_or("b", false); }, "b must be true or false"},
      {"t = 1", [](auto& t) { (void)t.text("t"); }, "t must be a text"},
      {"l = [1, 2]", [](auto& t) { (void)t.numbers("l", 3); }, "l must be a list of 3 numbers"},
      {"l = [1, true]", [](auto& t) { (void)t.numbers("l", 2); }, "l must be a list of 2 numbers"},
      {"m = [[1, 2], [3]]", [](auto& t) { (void)t.matrix("m", 2); },
       "m must be 2 rows of 2 numbers"},
      {"m = [[1, 2], [3, false]]", [](auto& t) { (void)t.matrix("m", 2); },
       "m must be 2 rows of 2 numbers"},
      {"w = []", [](auto& t) { (void)t.words("w"); }, "w is empty"},
      {"w = ['a', true]", [](auto& t) { (void)t.words("w"); }, "w must hold numbers or texts"},
      {"k = 1", [](auto& t) { (void)t.table("k"); }, "k must be a table"},
      {"k = 1", [](auto& t) { (void)t.tables("k"); }, "write [[k]] tables"},
      {"k = [1]", [](auto& t) { (void)t.tables("k"); }, "write [[k]] tables"},
  };
  for (const Case& c : cases) {
    const std::string message = complaint(c.text, c.read);
    EXPECT_EQ(message.rfind("f.toml:1: ", 0), 0U) << c.text << ": " << message;
    EXPECT_NE(message.find(c.why), std::string::npos) << c.text << ": " << message;
  }
}

TEST(TomlTable, KeepsTheFirstOfSeveralErrors) {
  EXPECT_EQ(complaint("x = 'a'\ny = 'b'\n",
                      [](TomlTable& table) {
                        (void)table.number("y");
                        (void)table.number("x");
                      }),
            "f.toml:2: y must be a finite number (column 5)");
}

TEST(TomlTable, TellsUnreadableFilesFromWrongOnes) {
  const auto absent = read_toml("/nonexistent/a.toml", "a file");
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, ErrorCode::kIo);
  const auto wrong = parse_toml("a = \n", "f.toml", "a file");
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().code, ErrorCode::kData);
  EXPECT_EQ(wrong.error().message.rfind("f.toml:1: ", 0), 0U) << wrong.error().message;
}

TEST(TomlTable, RefusesKeysThatNestWithoutEnd) {
  std::string key = "a";
  for (int i = 0; i < 100'000; ++i) key += ".a";
  for (const std::string& text :
       {"x = 1\n" + key + " = 1\n", "x = 1\n[" + key + "]\n", "x = 1\n[[" + key + "]]\n",
        "x = 1\na = { k = \"\"\" \" \"\"\", " + key + " = 1 }\n"}) {
    const auto table = parse_toml(text, "f.toml", "a file");
    ASSERT_FALSE(table.ok()) << text.substr(0, 20);
    EXPECT_EQ(table.error().message,
              "f.toml:2: a key of more than 32 dots; no table of a file nests as deep");
  }
  const std::string values =
      "x = 1\ny = " + std::string(100'000, '[') + std::string(100'000, ']') + "\n";
  const auto table = parse_toml(values, "f.toml", "a file");
  ASSERT_FALSE(table.ok());
  EXPECT_TRUE(table.error().message.starts_with("f.toml:2: ")) << table.error().message;
}

TEST(TomlTable, CountsNoDotsOfTextsCommentsAndNumbers) {
  const std::string dots(100, '.');
  const std::string text = "a = \"" + dots + "\"  # " + dots + "\nb = '" + dots +
                           "'\nc = \"\"\"\n\" " + dots + "\n" + dots +
                           "\"\"\"\nd = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, "
                           "1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, "
                           "1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]\n";
  EXPECT_EQ(parsed(text).text("a"), dots);
}

}  // namespace
}  // namespace ravencal::core
