#pragma once
// Whether an accuracy may be that of the mountings in the place of the labels.

#include <span>
#include <string>
#include <string_view>

#include "classifier/evaluate/splits.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// A mounting is of one label (they are counted within it, docs/dataset.md). Where one has trials
/// in both parts of a split, whatever tells mountings apart tells labels apart: where the cloth
/// lay, how it was turned, which pads it pressed. `files` names the trial of each row, or a window
/// of it. False where a trial's mounting is not known: nothing can be said then. True says nothing
/// of how much it matters, and false nothing of what all mountings of a label have in common.
bool shares_mountings(const Dataset& dataset, std::span<const std::string> files,
                      std::span<const classifier::Split> splits);

inline constexpr std::string_view confounded_with_mounting =
    "label and mounting are confounded: every mounting is of one label, and its trials both train "
    "and test";

}  // namespace weft::daemon
