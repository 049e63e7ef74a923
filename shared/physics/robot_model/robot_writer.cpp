// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/robot_writer.hpp"

#include <algorithm>
#include <cmath>

#include "core/isolated.hpp"
#include "core/whole_file.hpp"
#include "physics/plant_writer.hpp"
#include "physics/rigid_bodies.hpp"
#include "physics/robot_model/body_places.hpp"
#include "physics/robot_model/effects_callback.hpp"
#include "physics/robot_model/effects_in_models.hpp"
#include "physics/robot_model/model_edit.hpp"
#include "physics/robot_model/plant_of_model.hpp"
#include "physics/robot_model/robot_file.hpp"
#include "physics/robot_model/series_joints.hpp"

namespace ravencal::physics {
namespace {

namespace fs = std::filesystem;
using Eigen::VectorXd;
using tinyxml2::XMLElement;

/// What a line that the child sends says.
constexpr char kChanged = 'c', kNotExpressed = 'n';

/// Of the joint's inertia: a drive that has less makes the model's motion behind it singular.
constexpr double kLeastDrive = 1e-3;

/// Same joint of the same kind, carried by the same one, about the same axis.
bool same_joint(const Joint& own, const Joint& other) {
  if (own.name != other.name || own.kind != other.kind || !own.frame) return false;
  Frame placed = *own.frame;
  placed.position_m = other.frame->position_m;
  placed.rotation = other.frame->rotation;
  return same_frame(placed, *other.frame);
}

core::Status is_of_model(const Plant& plant, const Plant& given) {
  const auto refuse = [&](const std::string& what) {
    return core::data_error(fmt::format(
        "{}: {} than {} gives; `ravencal plant to` writes a plant into the model it was made from",
        plant.source, what, given.source));
  };
  if (plant.joints.size() != given.joints.size()) return refuse("has more or fewer joints");
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    if (!same_joint(plant.joints[j], given.joints[j]))
      return refuse(fmt::format("has another joint or axis at '{}'", plant.joints[j].name));
  }
  if (plant.coupling != given.coupling) return refuse("couples joints otherwise");
  return {};
}

/// What decides whether an effect can be written.
class Missing {
 public:
  Missing(ModelEdit& edit, const std::string& callback)
      : edit_(edit), joints_(plant_joints(edit.model)), callback_(callback) {}

  std::vector<std::string> list() {
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const Joint& given = edit_.given.joints[j];
      const Joint& wanted = edit_.wanted.joints[j];
      for (const Effect& effect : wanted.effects) {
        const bool had =
            std::find(given.effects.begin(), given.effects.end(), effect) != given.effects.end();
        if (acts(effect) && !had && !is_written(j, effect)) add(wanted, effect);
      }
      numbers(j, given, wanted);
    }
    return std::move(out_);
  }

 private:
  void add(const Joint& joint, const Effect& effect) {
    const EffectInModels& row = in_models(effect.id);
    std::string why;
    if (row.in_callback && !edit_.document.is_urdf()) {
      why = "in " + callback_;
    } else if (edit_.document.is_urdf() && !row.mjcf.empty()) {
      why = "MJCF can: convert the model by mj_saveLastXML";
    } else {
      why = row.remark;
    }
    out_.push_back(fmt::format("{}: {}{}{}{}", joint.name, effect.id, why.empty() ? "" : " (", why,
                               why.empty() ? "" : ")"));
  }

  [[nodiscard]] bool has_actuator(std::size_t j) const {
    return !edit_.document.is_urdf() &&
           actuator_of(edit_.document, edit_.model, joints_[j]) != nullptr;
  }

  [[nodiscard]] bool is_written(std::size_t j, const Effect& e) const {
    const EffectInModels& row = in_models(e.id);
    if ((edit_.document.is_urdf() ? row.urdf : row.mjcf).empty()) return false;
    const Joint& joint = edit_.wanted.joints[j];
    if (e.id == "coupling") {
      const auto from = edit_.wanted.joint_index(e.from);
      return from && edit_.given.coupling[j][*from] != 0.0;
    }
    if (e.id == "compliance") return joint_numbers(joint).stiffness > 0.0;
    if (e.id == "coulomb_friction") return joint.parameter(e.id, "level") > 0.0;
    if (e.id == "joint_friction")
      return joint.parameter(e.id, "level") > 0.0 && joint_numbers(joint).rigid();
    const bool of_actuator =
        e.id == "torque_constant" || e.id == "effort_offset" || e.id == "saturation";
    return !of_actuator || has_actuator(j);
  }

  /// What is no effect.
  void numbers(std::size_t j, const Joint& given, const Joint& wanted) {
    if (edit_.document.is_urdf() && joint_numbers(given).armature != joint_numbers(wanted).armature)
      out_.push_back(fmt::format("{}: motor_inertia {} kg m^2 (MJCF can: armature)", wanted.name,
                                 numbers_text(joint_numbers(wanted).armature)));
    const ActuatorNumbers before = actuator_numbers(given), after = actuator_numbers(wanted);
    if ((before.kp != after.kp || before.kd != after.kd) && !has_actuator(j))
      out_.push_back(fmt::format("{}: gains of the controller ({})", wanted.name,
                                 "where the joint has an actuator"));
    if (given.limits != wanted.limits)
      out_.push_back(
          fmt::format("{}: limits of its travel and speed (the model's own stay)", wanted.name));
    const double inertia = edit_.model.dof_M0[edit_.model.jnt_dofadr[joints_[j]]];
    const JointNumbers drive = joint_numbers(wanted);
    if (!edit_.document.is_urdf() && !drive.rigid() && drive.armature < kLeastDrive * inertia)
      out_.push_back(
          fmt::format("{}: an inertia of its drive (before a gap or a spring MuJoCo needs an "
                      "armature; the plant has {} kg m^2)",
                      wanted.name, numbers_text(drive.armature)));
    if (!same_frame(*given.frame, *wanted.frame) && !first_on_its_body(edit_.model, joints_[j]))
      out_.push_back(
          fmt::format("{}: where it stands (its body has a joint before it)", wanted.name));
    const int body = edit_.model.jnt_bodyid[joints_[j]];
    const bool shares = j + 1 < joints_.size() && edit_.model.jnt_bodyid[joints_[j + 1]] == body;
    if (shares && !(given.link == wanted.link))
      out_.push_back(
          fmt::format("{}: mass of its link (its body has a joint behind it)", wanted.name));
  }

  ModelEdit& edit_;
  std::vector<int> joints_;
  std::string callback_;
  std::vector<std::string> out_;
};

/// True if assets of textures, or of all other kinds, name files.
bool names_files(const RobotDocument& document, bool textures) {
  for (const XMLElement* asset = document.root().FirstChildElement("asset"); asset != nullptr;
       asset = asset->NextSiblingElement("asset"))
    for (const XMLElement* e = asset->FirstChildElement(); e != nullptr;
         e = e->NextSiblingElement())
      if (e->Attribute("file") != nullptr && is_named(*e, "texture") == textures) return true;
  return false;
}

/// Files of meshes and textures are named from the model's folder on.
void keep_assets(RobotDocument& document, const fs::path& from, const fs::path& to) {
  std::error_code error;
  const fs::path back = fs::relative(from, to, error);
  if (error || back.empty() || back == ".") return;
  for (const bool textures : {false, true}) {
    if (!names_files(document, textures)) continue;
    XMLElement* compiler = document.root().FirstChildElement("compiler");
    if (compiler == nullptr)
      compiler = document.root().InsertFirstChild(document.xml.NewElement("compiler"))->ToElement();
    const char* kind = textures ? "texturedir" : "meshdir";
    const char* own = compiler->Attribute(kind);
    if (own == nullptr) own = compiler->Attribute("assetdir");
    const fs::path folder = own != nullptr ? own : "";
    if (folder.is_relative()) compiler->SetAttribute(kind, (back / folder).string().c_str());
  }
}

/// A comment ends at two hyphens.
std::string as_comment(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at))
    text.replace(at, 2, "- -");
  return text;
}

void say_at_top(ModelEdit& edit, const WrittenRobot& written, const fs::path& model) {
  std::string text = fmt::format(
      "\n  {} with what a plant states otherwise, written by `ravencal plant to` or `diagnose`.\n",
      model.filename().string());
  if (edit.document.included > 0)
    text += fmt::format("  The {} files that it includes stand in it.\n", edit.document.included);
  for (const Joint& joint : edit.wanted.joints) {
    if (joint_numbers(joint).rigid() || edit.document.is_urdf()) continue;
    text += fmt::format(
        "  Joint {0} is where its drive is: the encoder of the motor. The link is at {0} plus what "
        "stands behind it ({0}_backlash, {0}_cable).\n",
        joint.name);
  }
  text += written.changed.empty() ? "  Nothing was changed.\n" : "  Changed:\n";
  for (const std::string& line : written.changed) text += "    " + line + "\n";
  if (!written.not_expressed.empty()) text += "  Not expressed:\n";
  for (const std::string& line : written.not_expressed) text += "    " + line + "\n";
  tinyxml2::XMLDocument& xml = edit.document.xml;
  tinyxml2::XMLNode* comment = xml.NewComment(as_comment(text).c_str());
  if (xml.FirstChild()->ToDeclaration() != nullptr)
    xml.InsertAfterChild(xml.FirstChild(), comment);
  else
    xml.InsertFirstChild(comment);
}

bool close(double one, double other) {
  return std::abs(one - other) <= kSameNumber * std::max(std::abs(one), std::abs(other));
}

/// What of the joint's own numbers reads back as another one; empty if none does.
std::string differing_number(const Joint& read, const Joint& wanted, bool of_urdf) {
  const JointNumbers a = joint_numbers(read), b = joint_numbers(wanted);
  if (!close(a.frictionloss, b.frictionloss)) return "friction";
  if (!close(a.damping, b.damping)) return "damping";
  if (of_urdf) return {};
  if (!close(a.armature, b.armature)) return "armature";
  if (!close(a.half_width, b.half_width)) return "backlash";
  const bool same_cable =
      close(a.stiffness, b.stiffness) && close(a.cable_damping, b.cable_damping);
  return same_cable ? "" : "stiffness";
}

/// The document as written gives the plant.
core::Status gives(const std::string& text, const Plant& wanted, const fs::path& out) {
  RAVENCAL_ASSIGN_OR_RETURN(const auto document, parse_robot_document(text, out));
  const bool of_urdf = document->is_urdf();
  RAVENCAL_ASSIGN_OR_RETURN(const RobotFile file, compile_robot(*document, out));
  RAVENCAL_ASSIGN_OR_RETURN(const Plant read,
                            plant_of_model(*file.model, out.string(), file.words));
  const auto refuse = [&](const std::string& what) {
    return core::data_error(
        fmt::format("{}: MuJoCo {} reads another {} than was written; write the model out by "
                    "mj_saveLastXML first",
                    out.string(), mj_versionString(), what));
  };
  if (read.joints.size() != wanted.joints.size()) return refuse("number of joints");
  for (std::size_t j = 0; j < wanted.joints.size(); ++j)
    if (const std::string number = differing_number(read.joints[j], wanted.joints[j], of_urdf);
        !number.empty())
      return refuse(fmt::format("{} of joint {}", number, wanted.joints[j].name));
  RAVENCAL_ASSIGN_OR_RETURN(RigidBodies own, RigidBodies::create(wanted));
  RAVENCAL_ASSIGN_OR_RETURN(RigidBodies other, RigidBodies::create(read));
  const VectorXd some =
      VectorXd::LinSpaced(static_cast<Eigen::Index>(wanted.joints.size()), 0.3, 0.7);
  const VectorXd efforts = own.efforts(some, some, some);
  if ((other.efforts(some, some, some) - efforts).norm() > 1e-7 * efforts.norm())
    return refuse("mass or inertia");
  return {};
}

core::Result<WrittenRobot> changed_model(const Plant& plant, const Plant& given,
                                         const fs::path& model, const fs::path& out) {
  RAVENCAL_ASSIGN_OR_RETURN(const RobotFile file, read_robot_file(model));
  RAVENCAL_ASSIGN_OR_RETURN(const auto document, read_robot_document(model));
  ModelEdit edit{*document, *file.model, given, plant};
  const std::string callback = callback_path(out).filename().string();
  WrittenRobot written;
  written.not_expressed = Missing(edit, callback).list();
  const core::Status edited = document->is_urdf() ? edit_urdf(edit) : edit_mjcf(edit);
  if (!edited.ok())
    return core::data_error(fmt::format("{}: {}", model.string(), edited.error().message));
  written.changed = edit.changed;
  if (!document->is_urdf()) written.callback = effects_callback(plant, callback);
  keep_assets(*document, fs::absolute(model).parent_path(), fs::absolute(out).parent_path());
  say_at_top(edit, written, model);
  written.text = document->text();
  RAVENCAL_RETURN_IF_ERROR(gives(written.text, plant, out));
  return written;
}

}  // namespace

bool is_robot_model(const fs::path& path) {
  return path.extension() == ".xml" || path.extension() == ".urdf" || path.extension() == ".xacro";
}

fs::path callback_path(const fs::path& out) {
  return out.parent_path() / (out.stem().string() + "_effects.cpp");
}

core::Status save_robot(const WrittenRobot& written, const fs::path& out) {
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(out, written.text));
  if (written.callback.empty()) return {};
  return core::write_whole_file(callback_path(out), written.callback);
}

core::Result<WrittenRobot> write_robot(const Plant& plant, const fs::path& model,
                                       const fs::path& out) {
  RAVENCAL_ASSIGN_OR_RETURN(const Plant given, load_plant(model));
  RAVENCAL_RETURN_IF_ERROR(is_of_model(plant, given));
  std::vector<std::string> said;
  const auto work = [&](const core::TakePiece& send) -> core::Status {
    RAVENCAL_ASSIGN_OR_RETURN(const WrittenRobot written, changed_model(plant, given, model, out));
    RAVENCAL_RETURN_IF_ERROR(core::send_text(send, written.text));
    RAVENCAL_RETURN_IF_ERROR(core::send_text(send, written.callback));
    for (const std::string& line : written.changed)
      RAVENCAL_RETURN_IF_ERROR(core::send_text(send, kChanged + line));
    for (const std::string& line : written.not_expressed)
      RAVENCAL_RETURN_IF_ERROR(core::send_text(send, kNotExpressed + line));
    return {};
  };
  RAVENCAL_RETURN_IF_ERROR(core::in_child(model, "changed", core::Isolation::reading(model), work,
                                          core::texts_into(said)));
  WrittenRobot written{said[0], {}, {}, said[1]};
  for (std::size_t k = 2; k < said.size(); ++k)
    (said[k][0] == kChanged ? written.changed : written.not_expressed).push_back(said[k].substr(1));
  return written;
}

}  // namespace ravencal::physics
