// SPDX-License-Identifier: Apache-2.0
//
// What it takes for something to be said: every threshold of a decision, with its meaning and its
// source. Scores are twice the negative log of a probability. Settings of a computation (grids,
// rounds, draws) and the noise's own limits stand where they work.
#pragma once

#include <cstddef>

namespace ravencal::diagnose {

// --- Score of a model ---

/// Of an effect: odds that a plant lacks one of some fifty candidates.
inline constexpr double kEffectCost = 8.0;
/// Of a free parameter (Akaike 1974).
inline constexpr double kParameterCost = 2.0;
/// Of what one model leaves, the dispersion of its innovations that counts as model error; beyond,
/// it explains so little that its innovations say nothing of the noise.
inline constexpr double kMostDispersion = 16.0;

// --- Gains of the loss over the dispersion ---

/// From which on a candidate is tried.
inline constexpr double kLeastGain = 10.0;
/// Whatever the chance of few blocks, and of a shape without a name, for which no physics speaks.
inline constexpr double kClearGain = 25.0;
/// Of a jump, and of a tone or a wave whose order no plant suggests: their place was searched for,
/// and chance by blocks does not apply.
inline constexpr double kLeastJumpGain = 25.0;
inline constexpr double kLeastToneGain = 32.0;
/// Of a tone: the same by its periodogram alone.
inline constexpr double kLeastToneStatistic = 16.0;
/// Within so many seconds of its moment the gain of a jump falls by so much: by 70 and more of true
/// ones in trials, by 36 and less of what slow wander imitates.
inline constexpr double kMomentKnown_s = 2.0;
inline constexpr double kLeastMomentGain = 40.0;
/// Of a name, or of a number that moves, on motion that no fit saw: false names of worlds that the
/// project did not write gained less, the true ones beside them more. Of a shape without a name,
/// for which no physics speaks, it is kClearGain.
inline constexpr double kLeastUnseenGain = 4.0;
/// Of the score: a name is twenty times likelier than its absence.
inline constexpr double kLeastLikelier = 6.0;
/// Gain that passes the chance over all candidates (3.9 deviations among some 150) nine times in
/// ten (1.28 further ones), and of a jump, whose place was searched for too: detection limits.
inline constexpr double kGainNineTimesInTen = 27.0;
inline constexpr double kJumpGainNineTimesInTen = 40.0;

// --- Sizes ---

/// Share of what the richer model leaves in a channel that an effect with a name changes at least,
/// and a shape without one.
inline constexpr double kLeastNamedSize = 0.4;
inline constexpr double kLeastShapeSize = 0.64;
/// Of a limit, in floors where it acts: where noise alone puts rows beyond it, they exceed it by
/// less than one.
inline constexpr double kLeastActingSize = 1.0;
/// Share of the rows in which a limit acts at most: a drive that follows nothing has no limit to
/// show.
inline constexpr double kMostLimited = 0.75;
/// Beside others: of what they and the plant's numbers change together. Their forms may be wrong by
/// as much.
inline constexpr double kLeastBesideOthers = 0.08;
/// Deviations of an effect's size from none, by its interval.
inline constexpr double kLeastSize_z = 2.5;
/// The same of a jump, beyond the 3.5 that some thousand moments give by chance.
inline constexpr double kLeastJumpSize_z = 6.0;
/// The same of a limit: efforts above it are flat to a twelfth. Greatest efforts are also those at
/// which friction was greatest, which looks like a limit of 5 to 10 deviations in trials; limits
/// have 20 and more.
inline constexpr double kLeastPresence_z = 12.0;
/// Deviations of its prior that a wrong number is off at least; one that is not said to be wrong
/// ends there.
inline constexpr double kWrongBy = 2.5;
/// Share of what a candidate changes that no parameter of the model can change, from which on it is
/// told apart.
inline constexpr double kLeastOwn = 0.003;
/// Two-sided 5 %: numbers of the plant that are known less well are held at the plant's values.
inline constexpr double kChance5_z = 1.96;
/// Probability that a name and those that it is not told apart from hold together.
inline constexpr double kCredible = 0.95;

// --- Laws of the controller ---

/// A law that explains less than this share of the squared command is not the one that made it, nor
/// is one whose gain differs between recordings by more than this factor.
inline constexpr double kLeastExplained = 0.75;
inline constexpr double kMostGainRatio = 1.2;

// --- What is left, whatever has a name ---

/// Share of what the plant predicts by which forms of its laws differ: LuGre's and Maxwell's
/// friction from a slip element, a stiffening cable from a straight one.
inline constexpr double kModelForm = 0.04;
/// A plant knows how much its friction varies to a factor of two, as it knows its wander.
inline constexpr double kKnownVariation = 2.0;
/// Floors that an effect takes beyond what the model says without it.
inline constexpr double kUnnamedPerFloor = 0.7;
/// Rows of a pass over those that resemble each other: two passes have noise of their own.
inline constexpr double kCorrelationsPerPass = 5.0;
/// Fewest passes for a standard error over them.
inline constexpr std::size_t kFewestPasses = 4;
/// Share of the circumstances' variance that rows of two passes must share to be compared: below
/// it they have less in common than not.
inline constexpr double kLeastAgreement = 0.5;
/// Of the squared signal: a plant that leaves more of it explains less than it leaves.
inline constexpr double kMostOfSignal = 0.5;

// --- Where ---

/// A circumstance holds clearly more than its share of the excess: by this factor, and by so many
/// standard errors over blocks.
inline constexpr double kMoreThanShare = 1.5;
inline constexpr double kClear_z = 3.0;

}  // namespace ravencal::diagnose
