!> Exact motion as phases. A phase is a set of closed contacts: while it lasts everything is linear and in closed form,
!> and it ends where the first of its signals falls to zero.
module motion_phases
   use certified_search, only: search_t
   use failures, only: failure_t
   use kinds, only: wp
   use response_types, only: response_t
   use run_observers, only: observers_t
   use run_recorder, only: asked_t, keep_sample, keep_shape, next_sample_time, recorder_t, sample_t, samples_before, &
      shape_due
   use tangent_columns, only: tangent_t
   implicit none (type, external)
   private
   public :: motion_t, phase_t, record_phase, found_taken_back, found_break

   !> A flight that did not happen: it was too low to be told from contact. The motion stands where it began.
   integer, parameter :: found_taken_back = 4
   !> Loads go on otherwise.
   integer, parameter :: found_break = 5

   !> Where the motion stands between two phases, and what was kept and measured of it until then.
   type :: motion_t
      real(wp) :: tau = 0.0_wp
      !> Free modal state, [modes]
      real(wp), allocatable :: q(:), v(:)
      type(recorder_t) :: recorder
      type(observers_t) :: observers
      !> Eigen-problems solved on the way
      integer :: factorisations = 0
      !> Its variations; unallocated: not asked for
      type(tangent_t), allocatable :: tangent
      !> Set where the run cannot go on
      type(failure_t), allocatable :: error
   end type motion_t

   type, abstract :: phase_t
      !> How it ends: the outcome is one of those of a search, `found_taken_back` or `found_break`
      type(search_t) :: search
   contains
      procedure(begin_interface), deferred :: begin
      procedure(find_end_interface), deferred :: find_end
      procedure(go_to_interface), deferred :: go_to
      procedure(sample_interface), deferred :: take_sample
      procedure(finish_interface), deferred :: finish
      procedure(measure_interface), deferred :: measure
      procedure(follow_interface), deferred :: follow
   end type phase_t

   abstract interface
      !> Take over the state of the motion.
      subroutine begin_interface(self, motion)
         import :: motion_t, phase_t
         implicit none (type, external)
         class(phase_t), target, intent(inout) :: self
         type(motion_t), intent(inout) :: motion
      end subroutine begin_interface

      !> First zero of the signals; sets `search`.
      subroutine find_end_interface(self, limit)
         import :: phase_t, wp
         implicit none (type, external)
         class(phase_t), intent(inout) :: self
         !> Time left to the end of the run
         real(wp), intent(in) :: limit
      end subroutine find_end_interface

      !> Free modal state at a time in the phase.
      subroutine go_to_interface(self, time, q, v, node)
         import :: phase_t, wp
         implicit none (type, external)
         class(phase_t), intent(in) :: self
         !> Since its start
         real(wp), intent(in) :: time
         !> State, [modes]
         real(wp), intent(out) :: q(:)
         real(wp), intent(out) :: v(:)
         !> Displacement and velocity of a massless node at the stop, besides those of the modes there
         real(wp), optional, intent(out) :: node(2)
      end subroutine go_to_interface

      !> The next sample; asked for one after the other, at equal steps.
      subroutine sample_interface(self, time, step, asked, sample)
         import :: asked_t, phase_t, sample_t, wp
         implicit none (type, external)
         class(phase_t), intent(inout) :: self
         !> Since the start of the phase
         real(wp), intent(in) :: time
         !> Distance of samples
         real(wp), intent(in) :: step
         type(asked_t), intent(in) :: asked
         !> Zeros at the first sample of a phase: what vanishes may stay
         type(sample_t), intent(inout) :: sample
      end subroutine sample_interface

      !> Bring the motion to the end of the phase, and its ledger.
      subroutine finish_interface(self, motion)
         import :: motion_t, phase_t
         implicit none (type, external)
         class(phase_t), intent(inout) :: self
         !> `tau` is still that of the start
         type(motion_t), intent(inout) :: motion
      end subroutine finish_interface

      !> Measure the phase.
      subroutine measure_interface(self, is_last, motion)
         import :: motion_t, phase_t
         implicit none (type, external)
         class(phase_t), target, intent(inout) :: self
         !> The run ends with it; `finish` was not called
         logical, intent(in) :: is_last
         !> `tau` is still that of the start
         type(motion_t), intent(inout) :: motion
      end subroutine measure_interface

      !> What follows the zero.
      subroutine follow_interface(self, motion, response)
         import :: motion_t, phase_t, response_t
         implicit none (type, external)
         class(phase_t), intent(inout) :: self
         type(motion_t), intent(inout) :: motion
         !> Gets the events
         type(response_t), intent(inout) :: response
      end subroutine follow_interface
   end interface

contains

   !> Keep the samples and shapes of a phase.
   subroutine record_phase(phase, is_last, motion, response)
      class(phase_t), intent(inout) :: phase
      !> The run ends with it
      logical, intent(in) :: is_last
      type(motion_t), intent(inout) :: motion
      !> Gets the histories
      type(response_t), intent(inout) :: response

      type(sample_t) :: sample
      real(wp), allocatable :: q(:), v(:)
      real(wp) :: node(2), to

      associate (recorder => motion%recorder)
         to = motion%tau + phase%search%time
         do while (shape_due(recorder, to, is_last))
            if (.not. allocated(q)) allocate (q(size(motion%q)), v(size(motion%v)))
            call phase%go_to(recorder%shape_tau(recorder%next_shape) - motion%tau, q, v, node)
            call keep_shape(recorder, q, v, node)
         end do
         do while (samples_before(recorder, to, is_last))
            call phase%take_sample(max(next_sample_time(recorder) - motion%tau, 0.0_wp), recorder%step, &
               recorder%asked, sample)
            recorder%next = recorder%next + 1
            call keep_sample(recorder%next, sample, recorder%ledger, response)
         end do
      end associate
   end subroutine record_phase

end module motion_phases
