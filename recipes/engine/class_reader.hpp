#pragma once
// Which fabrics a recipe takes for one class, such as the rasps among the objects of an imprint.

#include <string>
#include <vector>

#include "recipes/schema/object_reader.hpp"

namespace weft::recipes {

/// Reads the recipe's "classes", where it has them: the class of each of `fabrics`, or nothing.
/// Problems: fewer than two classes, a class without a fabric, a fabric that the recipe does not
/// have, has in two classes or in none.
std::vector<std::string> read_classes(ObjectReader& recipe, const std::vector<std::string>& fabrics,
                                      Problems& problems);

}  // namespace weft::recipes
