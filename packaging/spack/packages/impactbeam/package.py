# Recipe for Spack: `spack repo add packaging/spack`, then `spack install impactbeam`. It builds the main branch of the
# clone that it stands in: a release would name an archive and its checksum instead.
from pathlib import Path

from spack.package import *


class Impactbeam(CMakePackage):
    """Beams that hit stops, rebound, chatter and come to rest: finite elements, exact motion from event to event."""

    git = Path(__file__).resolve().parents[4].as_uri()
    license("MIT")
    version("main", branch="main")

    variant("mpi", default=True, description="Share sweeps among processes")
    variant("native", default=False, description="Compile for the processor of this machine")
    variant("pictures", default=True, description="Python with what impactbeam-plot needs")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("lapack")
    depends_on("hdf5+fortran+hl")
    depends_on("zlib-api")
    depends_on("cminpack")
    depends_on("mpi", when="+mpi")
    depends_on("python@3.9:", type="run", when="+pictures")
    depends_on("py-h5py", type="run", when="+pictures")
    depends_on("py-matplotlib", type="run", when="+pictures")

    requires("%gcc@11:", msg="gfortran 11 or later is needed")

    def cmake_args(self):
        return [
            self.define_from_variant("IMPACTBEAM_MPI", "mpi"),
            self.define_from_variant("IMPACTBEAM_NATIVE", "native"),
            self.define("BUILD_TESTING", self.run_tests),
        ]
