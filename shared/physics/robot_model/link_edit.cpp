// SPDX-License-Identifier: Apache-2.0
//
// Masses and inertias of a robot model's bodies as a plant states them, and its payload.
#include <algorithm>
#include <set>

#include "physics/robot_model/body_places.hpp"
#include "physics/robot_model/model_edit.hpp"
#include "physics/robot_model/series_joints.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using tinyxml2::XMLElement;

Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// The body whose motion is the link's: that of the joint, if no other joint follows on it.
std::optional<int> body_of_link(const mjModel& m, int joint) {
  const int body = m.jnt_bodyid[joint];
  const int end = m.body_jntadr[body] + m.body_jntnum[body];
  for (int j = joint + 1; j < end; ++j)
    if (!series_joint(m, j)) return std::nullopt;
  return body;
}

std::vector<int> fixed_to(const mjModel& m, int body) {
  std::set<int> moving_along = {body};
  std::vector<int> out;
  for (int b = body + 1; b < m.nbody; ++b) {
    if (m.body_jntnum[b] > 0 || !moving_along.contains(m.body_parentid[b])) continue;
    moving_along.insert(b);
    out.push_back(b);
  }
  return out;
}

/// A link whose inertia the plant changes: where, and the link's frame in its body's.
struct ChangedLink {
  std::size_t joint = 0;
  int body = 0;
  Isometry3d frame{Isometry3d::Identity()};
};

std::vector<ChangedLink> changed_links(const ModelEdit& edit) {
  std::vector<ChangedLink> out;
  const std::vector<int> joints = plant_joints(edit.model);
  const std::vector<Isometry3d> links = link_frames(edit.given);
  const std::vector<Isometry3d> bodies = body_frames(edit.model);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::optional<int> body = body_of_link(edit.model, joints[j]);
    if (body && !(edit.given.joints[j].link == edit.wanted.joints[j].link))
      out.push_back({j, *body, bodies[static_cast<std::size_t>(*body)].inverse() * links[j]});
  }
  return out;
}

/// As the link's, or none.
void state_inertial(ModelEdit& edit, XMLElement& body, const Isometry3d& frame, const Link& link) {
  XMLElement* e = body.FirstChildElement("inertial");
  if (e == nullptr)
    e = body.InsertFirstChild(edit.document.xml.NewElement("inertial"))->ToElement();
  for (const char* other : {"fullinertia", "axisangle", "xyaxes", "zaxis", "euler"})
    e->DeleteAttribute(other);
  const Quaterniond turn(frame.linear());
  e->SetAttribute("pos", text_of(frame * vector_of(link.com_m)).c_str());
  e->SetAttribute("quat", numbers_text(turn.w(), turn.x(), turn.y(), turn.z()).c_str());
  e->SetAttribute("mass", numbers_text(link.mass_kg).c_str());
  e->SetAttribute("diaginertia", text_of(vector_of(link.inertia_kg_m2)).c_str());
}

/// Shapes no longer weigh: every body states what it weighs as compiled.
void state_all_inertials(ModelEdit& edit, const Tree& tree) {
  const mjModel& m = edit.model;
  for (Index b = 1; b < m.nbody; ++b) {
    const mjtNum* q = m.body_iquat + 4 * b;
    const mjtNum* moments = m.body_inertia + 3 * b;
    const Isometry3d frame = Eigen::Translation3d(Eigen::Map<const Vector3d>(m.body_ipos + 3 * b)) *
                             Quaterniond(q[0], q[1], q[2], q[3]);
    state_inertial(edit, *tree.bodies[static_cast<std::size_t>(b)], frame,
                   {m.body_mass[b], {}, {moments[0], moments[1], moments[2]}});
  }
}

/// True where the model's own inertials do not count as they stand: then they are made to.
bool take_inertials_as_they_stand(ModelEdit& edit, const Tree& tree) {
  bool count = true;
  for (XMLElement* c = edit.document.root().FirstChildElement("compiler"); c != nullptr;
       c = c->NextSiblingElement("compiler")) {
    if (c->Attribute("inertiafromgeom", "true") == nullptr &&
        c->Attribute("settotalmass") == nullptr)
      continue;
    count = false;
    edit.set(*c, "inertiafromgeom", "auto", "compiler");
    c->DeleteAttribute("settotalmass");
  }
  if (!count) {
    edit.changed.emplace_back(
        "all bodies: the inertia that their shapes gave stands as <inertial>");
    state_all_inertials(edit, tree);
  }
  return !count;
}

std::string weighs(const ModelEdit& edit, std::size_t joint) {
  return fmt::format("{}: link of {} -> {} kg", edit.given.joints[joint].name,
                     numbers_text(edit.given.joints[joint].link.mass_kg),
                     numbers_text(edit.wanted.joints[joint].link.mass_kg));
}

bool payload_differs(const ModelEdit& edit) {
  return !(edit.given.payload == edit.wanted.payload) && edit.wanted.payload.mass_kg > 0.0;
}

/// Where the payload is in the frame of the last link's body.
Vector3d payload_place(const ModelEdit& edit, int body) {
  const Isometry3d link = link_frames(edit.given).back();
  return body_frames(edit.model)[static_cast<std::size_t>(body)].inverse() *
         (link * vector_of(edit.wanted.payload.com_m));
}

std::string unused_name(const mjModel& m, std::string name) {
  while (mj_name2id(&m, mjOBJ_BODY, name.c_str()) >= 0) name += "_";
  return name;
}

void add_payload(ModelEdit& edit, const Tree& tree) {
  const int body = edit.model.jnt_bodyid[plant_joints(edit.model).back()];
  XMLElement* e = edit.document.xml.NewElement("body");
  e->SetAttribute("name", unused_name(edit.model, "payload").c_str());
  e->SetAttribute("pos", text_of(payload_place(edit, body)).c_str());
  tree.bodies[static_cast<std::size_t>(body)]->InsertEndChild(e);
  state_inertial(edit, *e, Isometry3d::Identity(), {edit.wanted.payload.mass_kg, {}, {}});
  edit.changed.push_back(fmt::format("{}: payload of {} kg on the last link", e->Attribute("name"),
                                     numbers_text(edit.wanted.payload.mass_kg)));
}

XMLElement* urdf_link(RobotDocument& document, std::string_view name) {
  for (XMLElement* e = document.root().FirstChildElement("link"); e != nullptr;
       e = e->NextSiblingElement("link"))
    if (e->Attribute("name") != nullptr && e->Attribute("name") == name) return e;
  return nullptr;
}

const char* linked(const XMLElement& joint, const char* end) {
  const XMLElement* e = joint.FirstChildElement(end);
  const char* name = e != nullptr ? e->Attribute("link") : nullptr;
  return name != nullptr ? name : "";
}

/// The library takes links that are fixed to one another for one body: so do these numbers.
void lighten_fixed_links(RobotDocument& document, const std::string& link) {
  for (XMLElement* e = document.root().FirstChildElement("joint"); e != nullptr;
       e = e->NextSiblingElement("joint")) {
    if (e->Attribute("type", "fixed") == nullptr || linked(*e, "parent") != link) continue;
    const std::string child = linked(*e, "child");
    if (XMLElement* other = urdf_link(document, child))
      if (XMLElement* inertial = other->FirstChildElement("inertial")) other->DeleteChild(inertial);
    lighten_fixed_links(document, child);
  }
}

void state_urdf_inertial(ModelEdit& edit, XMLElement& link, const Vector3d& com, double mass_kg,
                         const Matrix3d& about_com) {
  XMLElement& e = child_of(edit.document, link, "inertial");
  XMLElement& origin = child_of(edit.document, e, "origin");
  origin.SetAttribute("xyz", text_of(com).c_str());
  origin.SetAttribute("rpy", "0 0 0");
  child_of(edit.document, e, "mass").SetAttribute("value", numbers_text(mass_kg).c_str());
  XMLElement& inertia = child_of(edit.document, e, "inertia");
  constexpr std::array kAxes = {'x', 'y', 'z'};
  for (Index i = 0; i < 3; ++i)
    for (Index k = i; k < 3; ++k)
      inertia.SetAttribute(fmt::format("i{}{}", kAxes.at(static_cast<std::size_t>(i)),
                                       kAxes.at(static_cast<std::size_t>(k)))
                               .c_str(),
                           numbers_text(about_com(i, k)).c_str());
}

void add_urdf_payload(ModelEdit& edit) {
  const int body = edit.model.jnt_bodyid[plant_joints(edit.model).back()];
  const std::string name = unused_name(edit.model, "payload");
  XMLElement* link = edit.document.xml.NewElement("link");
  link->SetAttribute("name", name.c_str());
  edit.document.root().InsertEndChild(link);
  state_urdf_inertial(edit, *link, Vector3d::Zero(), edit.wanted.payload.mass_kg, Matrix3d::Zero());
  XMLElement* joint = edit.document.xml.NewElement("joint");
  joint->SetAttribute("name", (name + "_fixed").c_str());
  joint->SetAttribute("type", "fixed");
  edit.document.root().InsertEndChild(joint);
  child_of(edit.document, *joint, "parent")
      .SetAttribute("link", mj_id2name(&edit.model, mjOBJ_BODY, body));
  child_of(edit.document, *joint, "child").SetAttribute("link", name.c_str());
  child_of(edit.document, *joint, "origin")
      .SetAttribute("xyz", text_of(payload_place(edit, body)).c_str());
  edit.changed.push_back(fmt::format("{}: payload of {} kg on the last link", name,
                                     numbers_text(edit.wanted.payload.mass_kg)));
}

}  // namespace

void edit_mjcf_links(ModelEdit& edit, const Tree& tree) {
  const std::vector<ChangedLink> links = changed_links(edit);
  const bool stated_anew = !links.empty() && take_inertials_as_they_stand(edit, tree);
  for (const ChangedLink& changed : links) {
    const Link& link = edit.wanted.joints[changed.joint].link;
    Link but_mass = edit.given.joints[changed.joint].link;
    but_mass.mass_kg = link.mass_kg;
    XMLElement& body = *tree.bodies[static_cast<std::size_t>(changed.body)];
    XMLElement* inertial = body.FirstChildElement("inertial");
    const std::vector<int> others = fixed_to(edit.model, changed.body);
    if (but_mass == link && others.empty() && inertial != nullptr && !stated_anew)
      inertial->SetAttribute("mass", numbers_text(link.mass_kg).c_str());
    else
      state_inertial(edit, body, changed.frame, link);
    // The link as a whole stands at the body of its joint.
    for (const int other : others)
      state_inertial(edit, *tree.bodies[static_cast<std::size_t>(other)], Isometry3d::Identity(),
                     {});
    edit.changed.push_back(weighs(edit, changed.joint));
  }
  if (payload_differs(edit)) add_payload(edit, tree);
}

core::Status edit_urdf_links(ModelEdit& edit) {
  for (const ChangedLink& changed : changed_links(edit)) {
    const char* name = mj_id2name(&edit.model, mjOBJ_BODY, changed.body);
    XMLElement* element = urdf_link(edit.document, name != nullptr ? name : "");
    if (element == nullptr)
      return core::data_error(fmt::format("has no link '{}', which MuJoCo reads", name));
    const Link& link = edit.wanted.joints[changed.joint].link;
    const Matrix3d turn = changed.frame.linear();
    state_urdf_inertial(edit, *element, changed.frame * vector_of(link.com_m), link.mass_kg,
                        turn * vector_of(link.inertia_kg_m2).asDiagonal() * turn.transpose());
    lighten_fixed_links(edit.document, element->Attribute("name"));
    edit.changed.push_back(weighs(edit, changed.joint));
  }
  if (payload_differs(edit)) add_urdf_payload(edit);
  return {};
}

}  // namespace ravencal::physics
