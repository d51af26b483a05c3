#pragma once
// `weft trade vibro`: learner x features x window x source on recordings of sound and vibration,
// under the paper's protocol and a stricter one. Also the paper's tables, and the page for the
// results of `weft vibro evaluate`.

#include <string>
#include <utility>
#include <vector>

#include "classifier/vibro/cross_validation.hpp"
#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recordings/recording_set.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct VibroTradeoffOptions {
  std::vector<classifier::Learner> learners = classifier::vibro::window_learners();
  std::vector<classifier::vibro::Family> families = {classifier::vibro::Family::smmrp,
                                                     classifier::vibro::Family::fft,
                                                     classifier::vibro::Family::smmrpfft};
  std::vector<double> windows_s = {1.0, 2.0};
  std::vector<std::string> sources = {};  ///< from list_sources(); empty: all
  /// The protocol that leaves out whole parts, beside the paper's random windows: blocks or groups.
  classifier::vibro::Protocol honest = classifier::vibro::Protocol::blocks;
  classifier::vibro::Combine combine = classifier::vibro::Combine::mean;
  std::size_t components = classifier::vibro::papers_components;
  /// Window and protocol are replaced for each choice.
  classifier::vibro::ProtocolOptions protocol;
  classifier::TrainOptions training;  ///< `stop` is called before each training
  std::size_t timings = 101;          ///< for the features of a window, at least 5
};

/// One choice and its result.
struct VibroPoint {
  classifier::Learner learner{};
  classifier::vibro::Family family{};
  double window_s = 0.0;
  std::string source;  ///< "S", "XYZ", "SXYZ"
  classifier::vibro::Protocol protocol{};
  classifier::vibro::CrossValidation result;
  double features_s = 0.0;  ///< per window, on one thread
};

/// Recordings that are too short for a window of one length under one protocol, over all sources.
struct VibroTooShort {
  classifier::vibro::Protocol protocol{};
  double window_s = 0.0;
  std::size_t parts = 1;  ///< parts of a recording; a window must fit into each
  std::vector<classifier::vibro::TooShort> recordings;
};

struct VibroTradeoff {
  std::vector<VibroPoint> points;
  classifier::vibro::Protocol honest = classifier::vibro::Protocol::blocks;
  /// For random windows and for the stricter protocol: the choice with the largest median.
  classifier::vibro::Leak random_leak, honest_leak;
  std::vector<std::string> left_out;  ///< learners without a library in this build
  std::vector<VibroTooShort> too_short;
  bool papers_recipe = false;  ///< is_papers_recipe() for its random windows
};

/// "S", "XYZ" and both if the recordings have sound and other channels; otherwise the existing one.
std::vector<std::string> list_sources(const RecordingSet& set);
/// The recordings with the channels of that source only.
std::vector<classifier::vibro::Recording> of_source(const RecordingSet& set,
                                                    const std::string& source);

/// "random windows", "contiguous parts", "whole recordings".
std::string protocol_name(classifier::vibro::Protocol protocol);

/// Time to compute the features of one window on this thread [s]: the median over `timings` windows
/// after an uncounted first one. `windows` were cut from `recordings`. Refuses what the extraction
/// refuses.
Result<double> vibro_features_time(const std::vector<classifier::vibro::Recording>& recordings,
                                   const classifier::vibro::WindowSet& windows,
                                   classifier::vibro::FeatureChoice choice, std::size_t timings,
                                   const classifier::SecondsNow& now);

/// Checks that need no training: fewer than 5 timings, what check() refuses, and each window and
/// protocol without splits or with windows that cannot be cut, using all channels.
Status check_vibro_tradeoff(const RecordingSet& set, const VibroTradeoffOptions& options);

/// Measures all choices under both protocols. Refuses what check_vibro_tradeoff(), extraction and
/// training refuse.
Result<VibroTradeoff> measure_vibro_tradeoff(const RecordingSet& set,
                                             const VibroTradeoffOptions& options,
                                             const classifier::SecondsNow& seconds_now,
                                             const TradeoffProgress& progress = {});

/// The result of a learner as a point of the trade-off page; accuracy is the macro F-score.
/// Settings and sliding time are not set; the family is the name.
TradeoffPoint vibro_tradeoff_point(BenchKind bench, std::string name,
                                   const classifier::vibro::CrossValidation& result,
                                   double features_s);

/// The choices of one protocol as a set of the trade-off page; accuracy is the macro F-score.
/// `file`: the name of the recordings as given by the user.
TradeoffSet vibro_tradeoff_set(const VibroTradeoff& tradeoff, const RecordingSet& set,
                               const std::string& file, classifier::vibro::Protocol protocol);

/// Table 1 (F-score for windows of 1 s and 2 s; rows of measured features), the averages over its
/// learners, and the data of Figure 4. Each cell shows our random windows, then our stricter
/// protocol. Then Table 2: for the source with most channels, the accuracy of each material over
/// all learners, and its wrong predictions. The paper's values are added if its recipe was run.
/// `badge_html`: badge of the bench for every table.
Blocks vibro_tables(const VibroTradeoff& tradeoff, const std::string& badge_html);

/// One learner, or the choice among several.
struct WindowLearner {
  std::string name;  ///< "knn", "best"
  classifier::vibro::CrossValidation result;
};

/// Learners are shown with their intervals, in this order.
struct VibroEvaluation {
  BenchKind bench = BenchKind::unknown;
  std::string dataset, sha256;
  std::vector<std::pair<std::string, std::string>> facts;  ///< name and value, plain text
  double window_s = 0, features_s = 0;                     ///< features_s: per window, measured
  std::vector<WindowLearner> learners;
  std::string importance;  ///< plain text; may be empty
};

/// Accuracy of recordings and windows with intervals, confusion matrix by material of each learner,
/// macro F-score against prediction time. Every picture shows the kind of bench. Refuses an empty
/// list of learners and values that are not finite.
Result<Document> vibro_document(const VibroEvaluation& evaluation);

}  // namespace weft::daemon
