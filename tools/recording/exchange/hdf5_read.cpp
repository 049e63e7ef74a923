// SPDX-License-Identifier: Apache-2.0
#include "exchange/hdf5_read.hpp"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "exchange/exported.hpp"
#include "exchange/hdf5_file.hpp"
#include "exchange/isolated_read.hpp"

namespace ravencal::exchange {
namespace {

/// Takes an export apart; FORMATS.md has the layout.
class ExportedHdf5 {
 public:
  explicit ExportedHdf5(const Hdf5File& file) : file_(file) {}

  core::Result<record::Recording> read() {
    for (auto& [key, value] : file_.attributes("/")) recording_.meta[key] = value;
    auto t_ns = file_.integers("t_ns");
    if (!t_ns) return damaged("t_ns is no vector of whole numbers");
    recording_.t_ns = std::move(*t_ns);
    RAVENCAL_RETURN_IF_ERROR(read_channels());
    RAVENCAL_RETURN_IF_ERROR(read_events());
    return std::move(recording_);
  }

 private:
  [[nodiscard]] core::Error damaged(std::string_view why) const {
    return core::data_error(
        fmt::format("{}: is an export of ravencal, but {}", file_.path().string(), why));
  }

  core::Status read_channels() {
    const NamedArray order = file_.array("channel_order");
    const std::size_t rows = recording_.t_ns.size();
    recording_.samples.resize(static_cast<Eigen::Index>(rows),
                              static_cast<Eigen::Index>(order.texts.size()));
    for (std::size_t c = 0; c < order.texts.size(); ++c) {
      const std::string& name = order.texts[c];
      const std::string set = "channels/" + name;
      if (!file_.has(set)) return damaged(fmt::format("{} is missing", set));
      const NamedArray values = file_.array(set);
      if (values.values.size() != rows || values.shape.size() != 1) {
        return damaged(
            fmt::format("{} has {} values for {} rows", set, values.values.size(), rows));
      }
      std::map<std::string, std::string> says;
      for (auto& [key, value] : file_.attributes(set)) says[key] = value;
      auto channel = exported_channel(name, says["unit"], says["role"], says["joint"]);
      if (!channel.ok()) return damaged(channel.error().message);
      recording_.channels.push_back(std::move(*channel));
      std::copy(values.values.begin(), values.values.end(),
                recording_.samples.col(static_cast<Eigen::Index>(c)).data());
    }
    return {};
  }

  core::Status read_events() {
    if (!file_.has("events")) return damaged("events is missing");
    const auto t_ns = file_.integers("events/t_ns");
    const NamedArray kinds = file_.array("events/kind");
    const NamedArray details = file_.array("events/detail");
    if (!t_ns || kinds.texts.size() != t_ns->size() || details.texts.size() != t_ns->size())
      return damaged("its events are not of one length");
    for (std::size_t i = 0; i < t_ns->size(); ++i)
      recording_.events.push_back({(*t_ns)[i], kinds.texts[i], details.texts[i]});
    return {};
  }

  const Hdf5File& file_;
  record::Recording recording_;
};

core::Result<Arrays> read_hdf5_here(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const Hdf5File file, Hdf5File::open(path));
  const auto names = file.datasets();
  if (!names) return core::data_error(fmt::format("{}: its groups are damaged", path.string()));
  Arrays arrays;
  for (const std::string& name : *names) arrays.push_back(file.array(name));
  return arrays;
}

core::Result<MaybeRecording> read_export_here(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const Hdf5File file, Hdf5File::open(path));
  const bool is_export = file.has("t_ns") && file.has("channels") && file.has("channel_order");
  if (!is_export) return MaybeRecording();
  RAVENCAL_ASSIGN_OR_RETURN(record::Recording recording, ExportedHdf5(file).read());
  return MaybeRecording(std::move(recording));
}

}  // namespace

core::Result<std::vector<NamedArray>> read_hdf5(const std::filesystem::path& path) {
  return in_child(path, "HDF5", read_hdf5_here);
}

core::Result<std::optional<record::Recording>> read_exported_hdf5(
    const std::filesystem::path& path) {
  return in_child(path, "HDF5", read_export_here);
}

}  // namespace ravencal::exchange
