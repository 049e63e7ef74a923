// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/motion.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

/// Effort that holds the plant's links against their weight, per joint and sample (N m or N), at
/// these joint positions ([joints][samples], NaN where unknown). A vector is empty where the plant
/// describes no weight or the positions are not known.
std::vector<Eigen::VectorXd> holding_efforts(const Plant& plant,
                                             const std::vector<Eigen::VectorXd>& positions);

/// Efforts that move the plant's links as `links` moves ([joints]) against weight and inertia, per
/// joint and sample (N m or N). Robots that state no frames and are neither a RAVEN-II nor a single
/// pendulum have no weight, and each joint moves its own link only.
std::vector<Eigen::VectorXd> link_efforts(const Plant& plant, const std::vector<Motion>& links);

/// Of the links and the payload together.
double moved_mass_kg(const Plant& plant);

/// True if links that weigh something get no weight, since nothing says where they are.
bool lacks_geometry(const Plant& plant);

/// Adds to `efforts` what balances the measured loads from outside (Joint::external_load);
/// `measured` ([joints][samples], in units of the channel) is empty where none was recorded.
void add_external_loads(const Plant& plant, const std::vector<Eigen::VectorXd>& measured,
                        std::vector<Eigen::VectorXd>& efforts);

/// The same of one joint.
void add_external_load(const Joint& joint, const Eigen::VectorXd& measured,
                       Eigen::VectorXd& effort);

/// holding_efforts() of a kilogram where the plant hangs its payload; empty where the plant has no
/// weight.
std::vector<Eigen::VectorXd> payload_efforts_per_kg(const Plant& plant,
                                                    const std::vector<Eigen::VectorXd>& positions);

/// Joint `to` per joint `from`, both in their units: the controller's coupling and the plant's
/// error on top.
double coupling_of(const Plant& plant, std::size_t to, std::size_t from);

/// Efforts of the joints ([joints][samples], N m or N; empty where unknown) as the motors feel
/// them, at the plant's nominal reductions. By virtual work: a joint that other motors move loads
/// these motors, and a joint that moves further than its motor angle says loads its motor more
/// (effects gain_error and coupling).
std::vector<Eigen::VectorXd> motor_efforts(const Plant& plant,
                                           const std::vector<Eigen::VectorXd>& joint_efforts);

/// The same as the joints' own cables carry them: by virtual work a cable that follows other
/// joints' links (Joint::coupling_through) pulls at these joints, and their cables hold it. Where
/// the plant does not say so, a cable carries its own joint alone.
std::vector<Eigen::VectorXd> cable_efforts(const Plant& plant,
                                           const std::vector<Eigen::VectorXd>& joint_efforts);

/// Inertia about a joint (kg m^2 or kg): where the plant states its frames, of everything that the
/// joint carries while all joints are at zero; else of its own link about the axis z.
double link_inertia(const Plant& plant, std::size_t joint);

/// Inertia of motor and link, referred to the joint (kg m^2 or kg).
double joint_inertia(const Plant& plant, std::size_t joint);

}  // namespace ravencal::physics
