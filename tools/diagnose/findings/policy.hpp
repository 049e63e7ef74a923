// SPDX-License-Identifier: Apache-2.0
//
// What it takes for something to be said: every threshold of the decision, with its meaning and its
// source. Scores are twice the negative log of a probability, so that odds of n : 1 are 2 ln n.
// Settings of a computation (grids, rounds, draws) and limits of one effect's physics stand where
// they work.
#pragma once

#include <cstddef>

namespace ravencal::diagnose {

// --- Priors: scores of the penalised likelihood (selection/score.cpp)
// -----------------------------

/// One candidate out of some twenty.
inline constexpr double kCandidateCost = 6.0;
/// A free coefficient or shape (Akaike 1974).
inline constexpr double kFreedomCost = 2.0;
/// 20 : 1 against missing physics: plants hold wrong numbers more often than they lack a mechanism.
inline constexpr double kMissingCost = 6.0;
/// 3 : 1 against a motor that is not what its data sheet says: friction changes with wear, warmth
/// and assembly, a magnet and a winding do not.
inline constexpr double kMotorCost = 2.2;
/// Variance of a number that lies anywhere within its tolerance, in squared tolerances.
inline constexpr double kVarianceWithin = 1.0 / 3.0;
/// A nominal parameter may leave its tolerance by this factor before the rest looks for a name: the
/// simulation's friction and cable are not the real ones to the last percent.
inline constexpr double kBeyondTolerance = 1.25;
/// Tolerance of weights and places that a plant states none for: 10 % with that margin.
inline constexpr double kUnstatedTolerance = 0.125;
/// Share of what the plant predicts by which forms of its laws differ: LuGre's and Maxwell's
/// friction from a slip element, a stiffening cable from a straight one.
inline constexpr double kModelForm = 0.04;
/// A plant knows how much its friction varies to a factor of two, as it knows its wander.
inline constexpr double kKnownVariation = 2.0;
/// Two drives of one kind differ by this much in effort per current, whatever is fitted to them.
inline constexpr double kLeastWeightDeviation = 0.05;

/// Relative deviation of the share of another cable's load that stretches this one, about a half:
/// it is none or all, but a cable that is softer than the plant's stretches by more than all.
inline constexpr double kLoadShareDeviation = 2.0;

// --- Differences of scores
// ------------------------------------------------------------------------

/// 20 : 1: clearly likelier.
inline constexpr double kClearScore = 6.0;
/// What a search through some hundred sets or pairs must gain that nothing called for: twice the
/// logs of their number and of 200 : 1.
inline constexpr double kUncalledScore = 20.0;
/// 150 : 1, from which on numbers that agree are no coincidence; nothing else called for a name.
inline constexpr double kNoCoincidence = 10.0;
/// Tolerances beyond which the plant's numbers cannot stand in for a common factor: it then shows
/// in the error like any other effect.
inline constexpr double kMostImitated = 1.5;

// --- Gates of one effect
// --------------------------------------------------------------------------

/// Chance over all candidates of one channel, where the caller has no share of the report's for it.
inline constexpr double kAlpha = 0.01;
/// Chance of a single look.
inline constexpr double kSingleLook = 0.05;
/// Held-out gain over its standard error, blocks as observations; and the two-sided chance of a
/// normal beyond it, for the same gain by flipping blocks' signs.
inline constexpr double kLeastGain_z = 2.5;
inline constexpr double kLeastGain_p = 0.0124;
/// The same where a model is asked beyond what it was fitted to, or a companion beside others: one
/// standard error (Breiman et al. 1984).
inline constexpr double kOneError = 1.0;
/// The same of what is kept without a name: chance one-sided 5 %.
inline constexpr double kLeastKeptGain_z = 1.645;
/// Of the held-out squared error that is left, what an effect must take.
inline constexpr double kLeastShare = 0.02;
/// Of it: what few stretches repeat counts as well.
inline constexpr double kMostShare = 0.5;
/// Floors that an effect takes beyond what the model can say without it; a shape without a name,
/// for which no physics speaks beforehand, must take more.
inline constexpr double kSizePerFloor = 0.5;
inline constexpr double kUnnamedPerFloor = 0.7;
/// Steps of a slow column between blocks must stand out this far before its levels count in full.
inline constexpr double kLeastStep_z = 8.0;
/// Difference between an effect's sizes in two halves of a circumstance from which on it is a
/// proxy, if it is more than chance (three standard errors): in trials that flagged 86 % of wrong
/// names and 5 % of right ones.
inline constexpr double kProxySpread = 0.5;
inline constexpr double kProxy_z = 3.0;

// --- Names
// ----------------------------------------------------------------------------------------

/// Probability that a name and those that it is not told apart from hold together.
inline constexpr double kCredible = 0.95;
/// An effect that so many others could stand for is not named: of five as likely ones it is one.
inline constexpr double kLeastInPlace = 0.2;
/// A richer form that leaves less than this share of an effect's part is that effect with more
/// freedom, and no rival.
inline constexpr double kContained = 0.05;
/// Change between turns below which what depends on each other is settled.
inline constexpr double kSettled = 0.1;
/// Levels of friction that drive and cable tell apart: found anew by both, they differ by less.
inline constexpr double kSameFriction = 0.35;

// --- What has no name
// -----------------------------------------------------------------------------

/// Of the error that is left, what a shape or a tone must take: simulators of friction and cables
/// all leave some percent of structure.
inline constexpr double kLeastUnnamedShare = 0.2;
/// The same of a shape over time, which is not repeated in every block.
inline constexpr double kLeastTimeShare = 0.5;
/// A name that gains less than this share of its gain beside a shape said nothing of its own...
inline constexpr double kOwnGain = 0.3;
/// ...and the shape must explain this much more of the excess than the name did.
inline constexpr double kMoreThanName = 0.15;

// --- What is left, whatever has a name
// ------------------------------------------------------------

/// Rows of a pass over those that resemble each other: two passes have noise of their own.
inline constexpr double kCorrelationsPerPass = 5.0;
/// Fewest passes for a standard error over them.
inline constexpr std::size_t kFewestPasses = 4;
/// Share of the circumstances' variance that rows of two passes must share to be compared: below
/// it they have less in common than not.
inline constexpr double kLeastAgreement = 0.5;
/// Of the squared signal: a plant that leaves more of it explains less than it leaves.
inline constexpr double kMostOfSignal = 0.5;

// --- Steps of the transmission
// --------------------------------------------------------------------

/// Chance of a step anywhere in a recording without one.
inline constexpr double kStepChance = 0.005;
/// A step over what 99 % of all other moments show.
inline constexpr double kStepRatio = 2.0;
/// Share of the error from which on a step is suspected to hide, and of what passed for noise that
/// may be left beside one that did.
inline constexpr double kHidingShare = 0.15;
inline constexpr double kMostLeftOfHidden = 0.75;
/// A lost count makes the servo leap by at least this share of the step; the tension that a slip
/// lets go kicks the motor by less than that one.
inline constexpr double kLostShare = 0.4;
inline constexpr double kKickShare = 0.3;

// --- Rows that are no sample of anything that repeats
// ---------------------------------------------

/// Deviations of a gross row, and what is left of them.
inline constexpr double kGross = 8.0;
inline constexpr double kTempered = 2.0;
/// Of the error's energy, what gross rows must hold; of all rows, what they may be; and in how many
/// stretches: more of them are something that repeats.
inline constexpr double kLeastGrossShare = 0.15;
inline constexpr double kMostGrossRows = 0.015;
inline constexpr std::size_t kMostGrossStretches = 4;

// --- Command
// --------------------------------------------------------------------------------------

/// A law that explains less than this share of the squared command, or of its changes, is not the
/// one that made it: half of its RMS is something else.
inline constexpr double kLeastExplained = 0.75;
/// The law with the found gain leaves less than this share of what it leaves with the plant's.
inline constexpr double kMostLeftOfGain = 0.5;
/// A gain is a number in software, but what is recorded of it is known to this share: a filter and
/// a law in steps of time bend it by 0.1 to 1.5 % in loops of 1 kHz that are recorded at 50 to
/// 500 Hz and explained well. Tolerance of a plant that states none.
inline constexpr double kGainTolerance = 0.02;
/// Pulses: edges over other changes of the command (noise has heavy tails) and over the command
/// itself (less is the law's own error), the level between two edges over the edge, what is left of
/// the law's residual, and the share of the time beyond which it is the controller's own level.
inline constexpr double kEdgeDeviations = 12.0;
inline constexpr double kLeastEdge = 0.02;
inline constexpr double kLeastLevel = 0.5;
inline constexpr double kMostLeftOfPulses = 0.5;
inline constexpr double kLongestPulse = 0.5;

}  // namespace ravencal::diagnose
