!> Result of the search for a mesh: the mesh, and its comparison with a finer mesh.
module mesh_checks
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: mesh_check_t

   !> The mesh of a run and, if the program chose it, its comparison with the next finer mesh.
   type :: mesh_check_t
      !> Number of elements of the mesh
      integer :: elements = 0
      !> Length of an element over that of the next element towards the tip
      real(wp) :: ratio = 1.0_wp
      !> Whether the inertia of the node at the stop is redistributed to neighbouring nodes
      logical :: is_redistributed = .false.
      !> Whether redistribution would be more accurate, but the inertia is not redistributed
      logical :: should_redistribute = .false.
      !> Number of elements of the finer mesh with which the mesh was compared; 0: the mesh was given and not compared
      integer :: finer_elements = 0
      !> Requested maximum of `difference`
      real(wp) :: tolerance = 0.0_wp
      !> Whether tolerance and difference are relative to the maximum displacement and to the instant of the first
      !> impact
      logical :: is_relative = .false.
      !> End of the comparison, tau
      real(wp) :: horizon = 0.0_wp
      !> Difference of the motions on both meshes: maximum over the differences of eta at stop and tip, and of the
      !> instants tau of first impact and settling
      real(wp) :: difference = 0.0_wp
      !> Whether the difference is within the tolerance, so that the mesh is accepted
      logical :: is_converged = .false.
      !> Whether the search ended because further meshes would have cost too much
      logical :: is_cut = .false.
   end type mesh_check_t

end module mesh_checks
