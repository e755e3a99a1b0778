// An HDF5 file as most programs write it, which our own writer never does.
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage::test {

/// /joints of six frames in the oldest layout, whose structure has no checksums.
inline void write_old_layout(const std::string& path) {
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t dims[3] = {6, kJoints, 3}, chunk[3] = {2, kJoints, 3};
  const std::vector<double> joints(6 * kJoints * 3, 0.25);
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE), space = H5Screate_simple(3, dims, nullptr);
  H5Pset_chunk(creation, 3, chunk);
  H5Pset_deflate(creation, 4);
  H5Pset_obj_track_times(creation, false);  // the same bytes each time
  const hid_t set =
      H5Dcreate2(file, "/joints", H5T_IEEE_F64LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
  H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, joints.data());
  H5Dclose(set);
  H5Sclose(space);
  H5Pclose(creation);
  H5Fclose(file);
}

}  // namespace restage::test
