// Which versions of the hot loops run here.
#pragma once

#include <string>

namespace pbrdf {

// v2, v3 or v4 of x86-64; elsewhere v2 stands for the one version there is.
std::string instruction_set();

}  // namespace pbrdf
