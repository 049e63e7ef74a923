// SPDX-License-Identifier: Apache-2.0
//
// Weights that an access control list lets others write or replace, while their mode looks sound.
#include <gtest/gtest.h>
#include <linux/posix_acl.h>
#include <linux/posix_acl_xattr.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;
using Entry = posix_acl_xattr_entry;

constexpr std::uint32_t kNobodyNamed = 0xFFFFFFFF;
constexpr std::uint32_t kStranger = 54321;
constexpr std::uint16_t kRead = ACL_READ;
constexpr std::uint16_t kWrite = ACL_READ | ACL_WRITE;
constexpr std::uint16_t kAll = ACL_READ | ACL_WRITE | ACL_EXECUTE;

/// As setfacl would: the owner's entries, these, and the mask.
std::vector<Entry> list_with(const std::vector<Entry>& named, std::uint16_t group = kRead,
                             std::uint16_t mask = kAll) {
  std::vector<Entry> list = {{ACL_USER_OBJ, kAll, kNobodyNamed}};
  for (const Entry& entry : named) {
    if (entry.e_tag == ACL_USER) list.push_back(entry);
  }
  list.push_back({ACL_GROUP_OBJ, group, kNobodyNamed});
  for (const Entry& entry : named) {
    if (entry.e_tag == ACL_GROUP) list.push_back(entry);
  }
  list.push_back({ACL_MASK, mask, kNobodyNamed});
  list.push_back({ACL_OTHER, kRead, kNobodyNamed});
  return list;
}

/// False where the file system knows no such lists.
bool set_list(const fs::path& path, const std::vector<Entry>& list) {
  const posix_acl_xattr_header header{POSIX_ACL_XATTR_VERSION};
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof header);
  bytes.append(reinterpret_cast<const char*>(list.data()), list.size() * sizeof list[0]);
  return ::setxattr(path.c_str(), "system.posix_acl_access", bytes.data(), bytes.size(), 0) == 0;
}

class AccessList : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    ASSERT_EQ(::chmod(folder_.c_str(), 0755), 0);
    ASSERT_EQ(::chown(folder_.c_str(), ::geteuid(), ::getegid()), 0);
    fs::copy_file(write_weights(make_model(8, {20}), "listed"), path_);
    ASSERT_EQ(::chmod(path_.c_str(), 0644), 0);
    if (!set_list(path_, list_with({}))) GTEST_SKIP() << "this file system has no such lists";
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::int32_t load() { return rig_.api().load(rig_.instance.get(), path_.c_str()); }
  [[nodiscard]] std::string error() const { return rig_.api().last_error(rig_.instance.get()); }
  void expect_refusal(const std::string& words) {
    EXPECT_EQ(load(), RAVENCAL_ERROR_TRUST) << words;
    EXPECT_NE(error().find(words), std::string::npos) << error();
    EXPECT_NE(error().find("setfacl -b"), std::string::npos) << error();
  }
  void expect_loads() { EXPECT_EQ(load(), RAVENCAL_SUCCESS) << error(); }

  Rig rig_;
  fs::path folder_ = scratch_folder() / "lists" / "deep";
  fs::path path_ = folder_ / "w.blob";
};

TEST_F(AccessList, OfTheFileMayLetNoOtherUserWrite) {
  ASSERT_TRUE(set_list(path_, list_with({{ACL_USER, kWrite, kStranger}})));
  expect_refusal("user 54321");
  expect_refusal(path_.string());
  ASSERT_TRUE(set_list(path_, list_with({{ACL_USER, kRead, kStranger}})));
  expect_loads();
}

TEST_F(AccessList, OfTheFileMayLetNoOtherGroupWrite) {
  ASSERT_TRUE(set_list(path_, list_with({{ACL_GROUP, kWrite, kStranger}})));
  expect_refusal("group 54321");
  ASSERT_TRUE(set_list(path_, list_with({{ACL_GROUP, kWrite, ::getegid()}})));
  expect_loads();
}

TEST_F(AccessList, MayLetTheOwnerAndRootWrite) {
  ASSERT_TRUE(
      set_list(path_, list_with({{ACL_USER, kWrite, 0}, {ACL_USER, kWrite, ::geteuid()}}, kWrite)));
  expect_loads();
}

TEST_F(AccessList, CountsOnlyAsFarAsItsMaskLetsIt) {
  ASSERT_TRUE(set_list(path_, list_with({{ACL_USER, kWrite, kStranger}}, kWrite, kRead)));
  expect_loads();
}

TEST_F(AccessList, OfAnyFolderAboveMayLetNobodyElseReplaceTheFile) {
  for (const fs::path& folder : {folder_, folder_.parent_path()}) {
    ASSERT_TRUE(set_list(folder, list_with({{ACL_USER, kAll, kStranger}}, kAll)));
    expect_refusal("its folder lets user 54321 replace it: setfacl -b " + folder.string());
    ASSERT_EQ(::removexattr(folder.c_str(), "system.posix_acl_access"), 0);
    expect_loads();
  }
}

TEST_F(AccessList, OfAStickyFolderDoesNotMatter) {
  ASSERT_TRUE(set_list(folder_, list_with({{ACL_USER, kAll, kStranger}}, kAll)));
  ASSERT_EQ(::chmod(folder_.c_str(), 01775), 0);
  expect_loads();
}

TEST_F(AccessList, OfALinkedFileIsJudgedWhereTheLinkLeads) {
  const fs::path link = folder_.parent_path() / "link.blob";
  fs::create_symlink(path_, link);
  ASSERT_TRUE(set_list(folder_, list_with({{ACL_GROUP, kAll, kStranger}}, kAll)));
  EXPECT_EQ(rig_.api().load(rig_.instance.get(), link.c_str()), RAVENCAL_ERROR_TRUST);
  EXPECT_NE(error().find("lets group 54321 replace it"), std::string::npos) << error();
}

TEST_F(AccessList, ThatIsTooLongIsRefused) {
  std::vector<Entry> named;
  for (std::uint32_t user = 0; user < 300; ++user) named.push_back({ACL_USER, kRead, 60000 + user});
  if (!set_list(path_, list_with(named))) GTEST_SKIP() << "this file system refuses it itself";
  expect_refusal("cannot be read");
}

}  // namespace
}  // namespace ravencal::test
