!> Exact motion as a sequence of phases. During a phase the set of closed contacts is constant, and the linear equations
!> of motion are solved in closed form, without time steps. A phase ends at the end of a load segment (a time span in
!> which each load is the sum of a constant, a linear function of time and harmonics), or at the first zero of a gap or
!> of a contact force.
module motion_phases
   use certified_search, only: found_exhausted
   use failures, only: failure_t
   use kinds, only: wp
   use run_observers, only: observers_t
   use run_recorder, only: recorder_t
   use tangent_columns, only: tangent_t
   implicit none (type, external)
   private
   public :: motion_t, found_cancelled, found_segment_end

   ! `found_exhausted` is the last outcome of a search; the following two are further outcomes of a phase.
   !> Outcome: the phase is a flight (motion above an open contact) below the hop tolerance. The flight is cancelled:
   !> the phase has length zero, and the motion stays at its start.
   integer, parameter :: found_cancelled = found_exhausted + 1
   !> Outcome: the phase ends with a load segment.
   integer, parameter :: found_segment_end = found_exhausted + 2

   !> State of the motion between two phases, with the records and measures up to that instant.
   type :: motion_t
      !> Instant, omega1 t
      real(wp) :: tau = 0.0_wp
      !> Displacements of the free modes, [modes]
      real(wp), allocatable :: q(:)
      !> Velocities of the free modes, [modes]
      real(wp), allocatable :: v(:)
      !> What is recorded, the number of the next sample, the recorded shapes, and the energy balance
      type(recorder_t) :: recorder
      !> Observers of the run
      type(observers_t) :: observers
      !> Number of eigenvalue problems solved so far: one for each set of closed contacts that the run uses for the
      !> first time
      integer :: eigenproblems = 0
      !> Variations of the motion (derivatives with respect to its initial state or a load parameter); unallocated: not
      !> requested
      type(tangent_t), allocatable :: tangent
      !> Set if the run cannot continue
      type(failure_t), allocatable :: error
   end type motion_t

end module motion_phases
