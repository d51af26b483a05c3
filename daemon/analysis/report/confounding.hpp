#pragma once
// Checks whether an accuracy may reflect mountings instead of labels.

#include <span>
#include <string>
#include <string_view>

#include "classifier/evaluate/splits.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// True if a mounting has trials in both parts of a split. Each mounting has one label (mountings
/// are counted within it, docs/reference/dataset.md). Then anything that distinguishes mountings
/// also distinguishes labels: place and orientation of the fabric, the taxels pressed. `files`
/// names the trial of each row, or a window of it. False also if the mounting of a trial is not
/// known, which gives no information. True does not show the size of the effect. False does not
/// exclude effects common to all mountings of a label.
bool shares_mountings(const Dataset& dataset, std::span<const std::string> files,
                      std::span<const classifier::Split> splits);

inline constexpr std::string_view confounded_with_mounting =
    "label and mounting are confounded: each mounting has one label, and its trials are in both "
    "training and test";

}  // namespace weft::daemon
