#include "trainer/run_log.h"

#include <gtest/gtest.h>

namespace darb {
namespace {

TEST(CfgArgs, names_what_the_photos_were_loaded_with) {
    Dataset dataset;
    dataset.root = "/photos";
    dataset.views.resize(2);
    dataset.views[1].is_test = true;
    dataset.options = {.images_folder = "images_4", .resolution = 2};
    TrainOptions options;
    options.sh_degree = 2;
    EXPECT_EQ(cfg_args(dataset, options, "/out"),
              "Namespace(sh_degree=2, source_path='/photos', model_path='/out', "
              "images='images_4', resolution=2, white_background=False, data_device='cpu', "
              "eval=True)");
}

}  // namespace
}  // namespace darb
