!> Result of the search for a mesh: the mesh, and its comparison with a finer one.
module mesh_checks
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: mesh_check_t

   !> The mesh of a run and, if the program chose it, its comparison with the next finer mesh.
   type :: mesh_check_t
      !> Number of elements
      integer :: elements = 0
      !> Length of an element over that of the next element towards the tip
      real(wp) :: ratio = 1.0_wp
      !> The inertia of the node at the stop is redistributed to neighbouring nodes
      logical :: is_redistributed = .false.
      !> The inertia is not redistributed, although redistribution would be more accurate
      logical :: should_redistribute = .false.
      !> Number of elements of the finer mesh; 0: the mesh was given and not compared
      integer :: compared = 0
      !> Requested tolerance
      real(wp) :: tolerance = 0.0_wp
      !> Tolerance and difference are relative to the maximum displacement and to the instant of the first impact
      logical :: is_relative = .false.
      !> End of the comparison, tau
      real(wp) :: horizon = 0.0_wp
      !> Maximum difference of eta at stop and tip, and of the instants tau of first impact and settling
      real(wp) :: difference = 0.0_wp
      !> The difference is within the tolerance, so the mesh is accepted
      logical :: is_converged = .false.
      !> The search ended because further meshes would have cost too much
      logical :: is_cut = .false.
   end type mesh_check_t

end module mesh_checks
