!> Comparison of a mesh with a finer one, from which a mesh was found.
module mesh_checks
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: mesh_check_t

   !> The mesh of a run and, if it was found, its comparison with the next finer one.
   type :: mesh_check_t
      !> Number of elements
      integer :: elements = 0
      !> Length of an element over that of the next element towards the tip
      real(wp) :: ratio = 1.0_wp
      !> The inertia of the stop's node is redistributed to its neighbours
      logical :: is_redistributed = .false.
      !> The inertia is not redistributed, although redistribution would be more accurate
      logical :: should_redistribute = .false.
      !> Number of elements of the finer mesh; 0: the mesh was given and not compared
      integer :: compared = 0
      !> Requested tolerance
      real(wp) :: tolerance = 0.0_wp
      !> Tolerance and difference are relative: to the maximum displacement, and to the instant of the first impact
      logical :: is_relative = .false.
      !> End of the comparison, tau, and maximum difference in eta of stop and tip, or in tau of first impact or
      !> settling
      real(wp) :: horizon = 0.0_wp
      real(wp) :: difference = 0.0_wp
      !> The difference is within the tolerance, so the mesh is accepted
      logical :: is_settled = .false.
      !> The search ended because further meshes would have cost too much
      logical :: is_cut = .false.
   end type mesh_check_t

end module mesh_checks
