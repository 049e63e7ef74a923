// SPDX-License-Identifier: Apache-2.0
#include "python/recording.hpp"

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "core/known_words.hpp"
#include "exchange/load.hpp"
#include "python/arrays.hpp"
#include "python/long_work.hpp"
#include "python/module.hpp"
#include "record/load.hpp"
#include "record/recording_writer.hpp"
#include "record/table.hpp"

namespace ravencal::python {
namespace {

using HeldPointer = std::shared_ptr<HeldRecording>;

HeldPointer load(const std::filesystem::path& path,
                 const std::optional<std::filesystem::path>& profile, const std::string& arm,
                 bool skip_bad, std::optional<double> from_s, std::optional<double> to_s) {
  record::LoadOptions options;
  if (profile) options.profile = profile->string();
  options.profile_options.arm = arm;
  options.skip_bad = skip_bad;
  options.range = {from_s, to_s};
  record::Recording recording = away_from_python(
      py::none(), [&](const Watch&) { return exchange::load_recording(path, options); });
  return std::make_shared<HeldRecording>(
      HeldRecording{std::move(recording), options.profile, options.range});
}

record::Profile profile_of_channels(const std::vector<record::Channel>& channels) {
  record::Profile profile;
  for (const record::Channel& channel : channels) {
    record::ProfileChannel& read = profile.channels.emplace_back();
    read.channel = channel;
    read.column = channel.name;
  }
  return profile;
}

constexpr const char* kTime = "t_s";
constexpr const char* kProfile = "arrays";

HeldPointer from_arrays(const py::dict& values, const py::object& t_s, const py::object& t_ns,
                        const std::optional<std::vector<record::Channel>>& channels,
                        const std::map<std::string, std::string>& meta, const std::string& name,
                        bool skip_bad) {
  if (t_s.is_none() == t_ns.is_none())
    throw Failure(core::usage_error("from_arrays: give the times either as t_s or as t_ns"));
  py::dict arrays = values.attr("copy")();
  if (!t_s.is_none()) arrays[kTime] = t_s;
  record::Table table = table_of(arrays, name);
  if (!t_ns.is_none()) table.t_ns = py::cast<std::vector<std::int64_t>>(t_ns);
  std::vector<std::string> names;
  for (const record::TableColumn& column : table.columns) names.push_back(column.name);
  record::Profile profile;
  if (channels) {
    profile = profile_of_channels(*channels);
    if (!t_s.is_none()) profile.time_column = kTime;
  } else {
    succeed(record::add_generic_channels(profile, names, name, !t_ns.is_none()));
  }
  profile.name = kProfile;
  profile.meta = meta;
  for (record::ProfileChannel& channel : profile.channels) channel.may_be_missing = true;
  record::LoadOptions options;
  options.skip_bad = skip_bad;
  return std::make_shared<HeldRecording>(
      HeldRecording{value_of(record::load_table(table, std::move(profile), options))});
}

const HeldRecording& held(const py::handle& self) { return self.cast<const HeldRecording&>(); }

py::array samples(const py::object& self) {
  const record::SampleMatrix& all = held(self).recording.samples;
  constexpr py::ssize_t kNumber = sizeof(double);
  return read_only_view(all.data(), {all.rows(), all.cols()}, {kNumber, kNumber * all.rows()},
                        self);
}

py::array channel_of(const py::object& self, const std::string& name) {
  const record::Recording& recording = held(self).recording;
  const std::optional<Eigen::Index> column = recording.column(name);
  if (!column) {
    std::vector<std::string> names;
    for (const record::Channel& channel : recording.channels) names.push_back(channel.name);
    throw py::key_error(fmt::format("{}: no channel '{}'{}", recording.source, name,
                                    core::instead_of(name, names)));
  }
  return read_only_view(recording.samples.col(*column).data(), {recording.rows()}, {sizeof(double)},
                        self);
}

record::Channel make_channel(const std::string& name, const std::string& unit,
                             const std::string& role, const std::string& joint) {
  const std::optional<record::Role> known = record::role_from(role);
  if (!known) {
    throw Failure(core::usage_error(fmt::format("channel {}: unknown role '{}'{}", name, role,
                                                core::instead_of(role, record::role_names()))));
  }
  return {name, unit, *known, joint};
}

void add_parts_of_recordings(py::module_& module) {
  using record::Channel;
  using record::Event;
  py::class_<Channel>(module, "Channel", "A column of a recording.")
      .def(py::init(&make_channel), py::arg("name"), py::arg("unit") = "1",
           py::arg("role") = "feature", py::arg("joint") = "")
      .def_readonly("name", &Channel::name)
      .def_readonly("unit", &Channel::unit)
      .def_property_readonly("role",
                             [](const Channel& c) { return std::string(record::name_of(c.role)); })
      .def_readonly("joint", &Channel::joint)
      .def("__repr__", [](const Channel& c) {
        return fmt::format("Channel(name='{}', unit='{}', role='{}', joint='{}')", c.name, c.unit,
                           record::name_of(c.role), c.joint);
      });
  py::class_<Event>(module, "Event", "Something that happened at a time.")
      .def_readonly("t_ns", &Event::t_ns)
      .def_readonly("kind", &Event::kind)
      .def_readonly("detail", &Event::detail)
      .def("__repr__", [](const Event& e) {
        return fmt::format("Event(t_ns={}, kind='{}', detail='{}')", e.t_ns, e.kind, e.detail);
      });
  using simulation::FollowedJoint;
  py::class_<FollowedJoint>(module, "FollowedJoint", "How a joint was simulated.")
      .def_readonly("joint", &FollowedJoint::joint)
      .def_readonly("how", &FollowedJoint::how)
      .def_readonly("rmse", &FollowedJoint::rmse_ji)
      .def_readonly("drawn_constant", &FollowedJoint::drawn_constant_ji);
}

void add_class(py::module_& module) {
  const auto field = [](auto member) {
    return [member](const HeldRecording& h) { return h.recording.*member; };
  };
  using record::Recording;
  py::class_<HeldRecording, HeldPointer>(module, "Recording",
                                         "Samples in SI units over time, one column per channel.")
      .def_static("from_arrays", &from_arrays, py::arg("values"), py::kw_only(),
                  py::arg("t_s") = py::none(), py::arg("t_ns") = py::none(),
                  py::arg("channels") = py::none(),
                  py::arg("meta") = std::map<std::string, std::string>(),
                  py::arg("name") = "arrays", py::arg("skip_bad") = false)
      .def_property_readonly(
          "t_ns",
          [](const py::object& self) { return read_only_view(held(self).recording.t_ns, self); })
      .def_property_readonly("samples", &samples)
      .def("__getitem__", &channel_of, py::arg("channel"))
      .def("__contains__",
           [](const HeldRecording& h, const std::string& name) {
             return h.recording.column(name).has_value();
           })
      .def_property_readonly("rows", [](const HeldRecording& h) { return h.recording.rows(); })
      .def_property_readonly("channels", field(&Recording::channels))
      .def_property_readonly("meta", field(&Recording::meta))
      .def_property_readonly("events", field(&Recording::events))
      .def_property_readonly("source", field(&Recording::source))
      .def_readonly("followed", &HeldRecording::followed)
      .def(
          "save",
          [](const HeldRecording& h, const std::filesystem::path& path, bool overwrite) {
            const py::gil_scoped_release unlocked;
            succeed(record::write_recording(h.recording, path, overwrite));
          },
          py::arg("path"), py::kw_only(), py::arg("overwrite") = false)
      .def("__repr__", [](const HeldRecording& h) {
        return fmt::format("<ravencal.Recording {}: {} rows, {} channels>", h.recording.source,
                           h.recording.rows(), h.recording.channels.size());
      });
}

}  // namespace

std::vector<RecordingPointer> recordings_of(const py::object& given) {
  if (given.is_none()) return {};
  if (py::isinstance<HeldRecording>(given)) return {given.cast<HeldPointer>()};
  std::vector<RecordingPointer> all;
  for (const py::handle& one : given) {
    if (!py::isinstance<HeldRecording>(one))
      throw py::type_error("give a ravencal.Recording or several; ravencal.load reads a file");
    all.push_back(one.cast<HeldPointer>());
  }
  return all;
}

void add_recording(py::module_& module) {
  add_parts_of_recordings(module);
  add_class(module);
  module.def("load", &load, "Reads a recording, or another table through a profile.",
             py::arg("path"), py::arg("profile") = py::none(), py::arg("arm") = "gold",
             py::arg("skip_bad") = false, py::arg("from_s") = py::none(),
             py::arg("to_s") = py::none());
}

}  // namespace ravencal::python
