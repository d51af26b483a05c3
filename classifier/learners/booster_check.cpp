#include "classifier/learners/learners.hpp"
#include "protocols/base/json_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace weft::classifier {
namespace {

using nlohmann::json;
using Numbers = std::vector<std::int64_t>;

constexpr std::size_t deepest = 32;  // a booster's own text has 7 levels

// The library's reader is recursive per bracket, so the depth must be limited.
json parsed(std::string_view text) {
  return parse_json(text, {text.size(), deepest}).value_or(json());
}

const json& at(const json& in, const char* path) {
  static const json nothing;
  const json::json_pointer where(path);
  return in.contains(where) ? in[where] : nothing;
}

// True if the parameter is this number, written as text.
bool has_number(const json& in, const char* path, std::size_t number) {
  const json& value = at(in, path);
  return value.is_string() && value.get_ref<const std::string&>() == std::to_string(number);
}

// The form of XGBoost is "5E-1"; from 3.1 on it has brackets.
bool is_finite_text(const json& in) {
  if (!in.is_string()) return false;
  std::string_view text = in.get_ref<const std::string&>();
  if (text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
  float value = 0.0F;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  return read.ec == std::errc() && read.ptr == text.data() + text.size() && std::isfinite(value);
}

// The numbers; empty if `list` is not a list of whole numbers.
Numbers whole_numbers(const json& list) {
  Numbers out;
  if (!list.is_array()) return out;
  for (const json& value : list) {
    if (!value.is_number_integer()) return {};
    out.push_back(value.get<std::int64_t>());
  }
  return out;
}

// Checks the range of single precision, which the library uses.
bool all_numbers(const json& list, std::size_t count) {
  constexpr double largest = std::numeric_limits<float>::max();
  return list.is_array() && list.size() == count && std::ranges::all_of(list, [](const json& v) {
           return v.is_boolean() || (v.is_number() && std::abs(v.get<double>()) <= largest);
         });
}

Status check_lengths(const json& tree, std::size_t nodes) {
  constexpr std::array lists = {
      "/base_weights", "/default_left",   "/left_children",    "/loss_changes",  "/parents",
      "/split_type",   "/right_children", "/split_conditions", "/split_indices", "/sum_hessian"};
  for (const char* list : lists)
    if (!all_numbers(at(tree, list), nodes))
      return fail({.code = Errc::corrupt,
                   .what = "invalid list in a tree of the booster",
                   .expected = std::to_string(nodes) + " numbers",
                   .got = std::to_string(at(tree, list).size()) + " of " + (list + 1)});
  if (!has_number(tree, "/tree_param/num_nodes", nodes))
    return fail({.code = Errc::corrupt,
                 .what = "wrong number of nodes in a tree of the booster",
                 .expected = std::to_string(nodes),
                 .got = at(tree, "/tree_param/num_nodes").dump()});
  return {};
}

// The root has no parent and no node has two, so every path ends. Pruned nodes keep a parent that
// no longer has children.
Status check_branches(const Numbers& left, const Numbers& right, const Numbers& parent) {
  const auto nodes = static_cast<std::int64_t>(left.size());
  std::vector<bool> has_parent(left.size());
  for (std::size_t i = 0; i < left.size(); ++i) {
    if (i > 0 && (parent[i] < 0 || parent[i] >= nodes))
      return fail({.code = Errc::corrupt,
                   .what = "parent of a booster node out of range",
                   .expected = "less than " + std::to_string(nodes),
                   .got = std::to_string(parent[i])});
    if (left[i] == -1 && right[i] == -1) continue;
    for (const std::int64_t child : {left[i], right[i]}) {
      if (child < 1 || child >= nodes || has_parent[static_cast<std::size_t>(child)])
        return fail({.code = Errc::corrupt,
                     .what = "invalid child of a booster node",
                     .expected = "an unused node from 1 to " + std::to_string(nodes - 1),
                     .got = std::to_string(child)});
      if (parent[static_cast<std::size_t>(child)] != static_cast<std::int64_t>(i))
        return fail({.code = Errc::corrupt,
                     .what = "wrong parent of a booster node",
                     .expected = std::to_string(i),
                     .got = std::to_string(parent[static_cast<std::size_t>(child)])});
      has_parent[static_cast<std::size_t>(child)] = true;
    }
  }
  return {};
}

Status check_tree(const json& tree, std::size_t features) {
  const Numbers left = whole_numbers(at(tree, "/left_children"));
  const Numbers right = whole_numbers(at(tree, "/right_children"));
  const Numbers parent = whole_numbers(at(tree, "/parents"));
  const Numbers feature = whole_numbers(at(tree, "/split_indices"));
  const Numbers kind = whole_numbers(at(tree, "/split_type"));
  if (left.empty())
    return fail({.code = Errc::corrupt, .what = "tree of the booster without nodes"});
  if (auto ok = check_lengths(tree, left.size()); !ok) return ok;
  if (right.size() != left.size() || parent.size() != left.size() ||
      feature.size() != left.size() || kind.size() != left.size())
    return fail({.code = Errc::corrupt, .what = "node numbers of the booster not whole numbers"});
  if (auto ok = check_branches(left, right, parent); !ok) return ok;
  for (std::size_t i = 0; i < left.size(); ++i) {
    if (left[i] == -1) continue;
    if (feature[i] < 0 || feature[i] >= static_cast<std::int64_t>(features))
      return fail({.code = Errc::corrupt,
                   .what = "feature number of the booster out of range",
                   .expected = "less than " + std::to_string(features),
                   .got = std::to_string(feature[i])});
  }
  for (const char* list :
       {"/categories", "/categories_nodes", "/categories_segments", "/categories_sizes"})
    if (!at(tree, list).empty())
      return fail({.code = Errc::corrupt,
                   .what = "booster with categorical splits",
                   .expected = "numeric splits"});
  if (std::ranges::any_of(kind, [](std::int64_t k) { return k != 0; }))
    return fail({.code = Errc::corrupt,
                 .what = "booster with categorical splits",
                 .expected = "numeric splits"});
  return {};
}

// Each tree adds to the class that it names.
Status check_classes(const json& model, std::size_t trees, std::size_t classes) {
  const Numbers of_tree = whole_numbers(at(model, "/tree_info"));
  if (of_tree.size() != trees || !has_number(model, "/gbtree_model_param/num_trees", trees))
    return fail({.code = Errc::corrupt,
                 .what = "wrong number of trees in the booster",
                 .expected = std::to_string(trees),
                 .got = std::to_string(of_tree.size())});
  for (const std::int64_t c : of_tree)
    if (c < 0 || c >= static_cast<std::int64_t>(classes))
      return fail({.code = Errc::corrupt,
                   .what = "class number of the booster out of range",
                   .expected = "less than " + std::to_string(classes),
                   .got = std::to_string(c)});
  return {};
}

// Trees of a round, of all classes together, follow each other; from 2.0 on the file has the starts
// of the rounds.
Status check_rounds(const json& model, std::size_t trees, std::size_t classes) {
  constexpr std::array at_a_time = {std::size_t{1}, trees_of_forest};
  const bool known = std::ranges::any_of(at_a_time, [&](std::size_t parallel) {
    return has_number(model, "/gbtree_model_param/num_parallel_tree", parallel) &&
           trees % (parallel * classes) == 0;
  });
  if (!known)
    return fail({.code = Errc::corrupt,
                 .what = "incomplete rounds of trees in the booster",
                 .expected = "1 or " + std::to_string(trees_of_forest) + " trees per class",
                 .got = at(model, "/gbtree_model_param/num_parallel_tree").dump()});
  const json& begins = at(model, "/iteration_indptr");
  const Numbers from = whole_numbers(begins);
  if (!begins.is_null() && (from.size() < 2 || from.front() != 0 || !std::ranges::is_sorted(from) ||
                            from.back() != static_cast<std::int64_t>(trees)))
    return fail({.code = Errc::corrupt, .what = "invalid rounds in the booster"});
  return {};
}

Status check_learner(const json& learner, std::size_t features, std::size_t classes) {
  if (!has_number(learner, "/learner_model_param/num_feature", features) ||
      !has_number(learner, "/learner_model_param/num_class", classes) ||
      !has_number(learner, "/objective/softmax_multiclass_param/num_class", classes))
    return fail({.code = Errc::corrupt,
                 .what = "booster does not match the model's features and labels",
                 .expected = std::to_string(features) + " features, " + std::to_string(classes) +
                             " labels"});
  if (at(learner, "/objective/name") != "multi:softprob" ||
      at(learner, "/gradient_booster/name") != "gbtree")
    return fail({.code = Errc::corrupt,
                 .what = "unsupported kind of booster",
                 .expected = "gbtree with multi:softprob"});
  if (!is_finite_text(at(learner, "/learner_model_param/base_score")))
    return fail({.code = Errc::corrupt,
                 .what = "base score of the booster not finite",
                 .expected = "a finite number",
                 .got = at(learner, "/learner_model_param/base_score").dump()});
  const json& model = at(learner, "/gradient_booster/model");
  const json& trees = at(model, "/trees");
  if (!trees.is_array() || trees.empty())
    return fail({.code = Errc::corrupt, .what = "booster without trees"});
  for (std::size_t i = 0; i < trees.size(); ++i) {
    if (at(trees[i], "/id") != i)  // the library reads trees in parallel, each into its own place
      return fail({.code = Errc::corrupt,
                   .what = "trees of the booster not in order",
                   .expected = std::to_string(i),
                   .got = at(trees[i], "/id").dump()});
    if (auto ok = check_tree(trees[i], features); !ok) return ok;
  }
  if (auto ok = check_classes(model, trees.size(), classes); !ok) return ok;
  return check_rounds(model, trees.size(), classes);
}

}  // namespace

Result<std::string> checked_booster(std::string_view text, std::size_t features,
                                    std::size_t classes) {
  const json booster = parsed(text);
  if (auto ok = check_learner(at(booster, "/learner"), features, classes); !ok)
    return pass(std::move(ok).error());
  return booster.dump();
}

}  // namespace weft::classifier
