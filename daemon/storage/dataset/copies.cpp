#include "daemon/storage/dataset/copies.hpp"

#include <algorithm>
#include <map>
#include <span>

#include "daemon/base/file/sha256.hpp"

namespace weft::daemon {
namespace {

std::string content_of(const classifier::Trial& trial) {
  Sha256 hash;
  hash.number(static_cast<std::uint64_t>(trial.taxels));
  for (const Phase phase : trial.phase) hash.number(to_char(phase));
  hash.numbers(std::span<const double>(trial.counts));
  return to_hex(hash.finish());
}

}  // namespace

Copies copies_among(const std::vector<std::string>& names,
                    const std::vector<std::string>& contents) {
  Copies all;
  std::map<std::string, std::size_t> place;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto [at, is_new] = place.emplace(contents[i], all.size());
    if (is_new) all.emplace_back();
    all[at->second].push_back(names[i]);
  }
  std::erase_if(all, [](const auto& own) { return own.size() < 2; });
  return all;
}

Copies copies_in(const Dataset& dataset) {
  std::vector<std::string> names, contents;
  for (const classifier::Trial& trial : dataset.trials) {
    names.push_back(trial.file);
    contents.push_back(content_of(trial));
  }
  return copies_among(names, contents);
}

std::string copies_text(const Copies& copies) {
  constexpr std::size_t most_named = 5;
  if (copies.empty()) return {};
  std::string out = "COPIES: the same samples under several names: ";
  for (std::size_t i = 0; i < std::min(copies.size(), most_named); ++i) {
    if (i > 0) out += "; ";
    for (std::size_t k = 0; k < copies[i].size(); ++k) out += (k > 0 ? " = " : "") + copies[i][k];
  }
  if (copies.size() > most_named)
    out += "; and " + std::to_string(copies.size() - most_named) + " more";
  return out + ". Leave all but one of each out: a copy that trains answers for one that tests.\n";
}

}  // namespace weft::daemon
