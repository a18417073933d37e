!> Applied loads of Newmark's steps, and damping that is not proportional to the stiffness.
!>
!> A step ends at each jump of a load, as at an event: the step is halved until it ends at the jump, with the load
!> before the jump, and the next step begins with the load after the jump. A kink of a load (a jump of its rate) may lie
!> within a step: it adds an error of second order to this one step, and the number of kinks does not depend on the
!> length of the steps, so the order of the method remains two.
module newmark_loads
   use applied_loads, only: gather_loads, has_loads
   use beam_model, only: beam_model_t
   use contact_rows, only: band
   use failures, only: failure_t
   use free_modes, only: find_free_modes, free_modes_t
   use kinds, only: lambda1_power4, wp
   use load_courses, only: value_at
   use load_settings, only: course_pulse, course_table, pulse_half_sine, time_course_t
   use mode_choice, only: rates_of_modes
   use newmark_run, only: instant_of, newmark_run_t, whole_step
   use newmark_stepper, only: deepest_level, newmark_stepper_t
   use run_settings, only: run_settings_t
   use skyline_matrix, only: make_skyline, multiply, skyline_t
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: prepare_loads, load_at, load_at_end, level_to_jump, pass_jump, additional_damping

contains

   !> Collect the loads of a run, and the instants at which a load may jump.
   subroutine prepare_loads(model, settings, run)
      !> The beam, in degrees of freedom of its nodes
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(newmark_run_t), intent(inout) :: run

      integer :: g, i

      allocate (run%jumps(0))
      if (.not. has_loads(settings)) return
      call gather_loads(model, settings, run%loads)
      ! loads on degrees of freedom that a rigid support (stiffness 0) fixes have no effect
      do i = 1, size(model%supports)
         if (model%supports(i)%stiffness <= 0.0_wp) run%loads%vector(model%supports(i)%dof, :) = 0.0_wp
      end do
      if (allocated(run%modes)) run%loads%vector = matmul(transpose(run%modes%mode), run%loads%vector)
      do g = 1, run%loads%count
         associate (instants => jumps_of(run%loads%course(g), settings%response%step))
            run%jumps = [run%jumps, pack(instants, instants > 0.0_wp .and. instants <= settings%response%duration)]
         end associate
      end do
      run%jumps = run%jumps(ascending_order(run%jumps))
   end subroutine prepare_loads

   !> Instants at which the time course of a load begins or ends, and instants within a half sine that is short beside
   !> the step: the load is zero at both ends, so that a step over the whole pulse would have no impulse.
   pure function jumps_of(course, step) result(instants)
      type(time_course_t), intent(in) :: course
      !> Length of the undivided step, tau
      real(wp), intent(in) :: step
      real(wp), allocatable :: instants(:)

      ! minimum number of steps in a half sine; the impulse of so many differs by 0.1 % from that of the pulse
      integer, parameter :: min_steps = 32
      integer :: i

      instants = [course%start, course%end]
      if (course%kind == course_pulse) instants = [instants, course%start + course%duration]
      if (course%kind == course_pulse .and. course%shape == pulse_half_sine .and. &
         course%duration < real(min_steps, wp)*step) instants = [instants, course%start + course%duration* &
         [(real(i, wp)/real(min_steps, wp), i=1, min_steps - 1)]]
      if (course%kind == course_table) instants = [instants, course%start + course%time(1), &
         course%start + course%time(size(course%time))]
   end function jumps_of

   !> The load vector at an instant; at a jump, the load after the jump.
   pure subroutine load_at(run, tau, load)
      type(newmark_run_t), intent(in) :: run
      real(wp), intent(in) :: tau
      !> Load vector, padded with zeros at both ends
      real(wp), intent(inout) :: load(1 - band:)

      integer :: g

      associate (nodal_load => load(1:run%stepper%order))
         nodal_load = 0.0_wp
         do g = 1, run%loads%count
            nodal_load = nodal_load + value_at(run%loads%course(g), tau)*run%loads%vector(:, g)
         end do
      end associate
   end subroutine load_at

   !> The load vector at the end of a step; at a jump, the load before the jump.
   pure subroutine load_at_end(run, tau, load, instant)
      type(newmark_run_t), intent(in) :: run
      !> End of the step, tau
      real(wp), intent(in) :: tau
      !> Load vector, padded with zeros at both ends
      real(wp), intent(inout) :: load(1 - band:)
      !> Instant at which the load was evaluated
      real(wp), intent(out) :: instant

      ! the load is evaluated at least this fraction of the undivided step before the jump
      real(wp), parameter :: before = 1.0e-9_wp

      instant = tau
      if (run%next_jump <= size(run%jumps)) then
         associate (jump => run%jumps(run%next_jump))
            if (tau >= jump - jump_tolerance(run%stepper, jump)) then
               instant = jump - max(before*run%stepper%step, 16.0_wp*epsilon(jump)*jump)
            end if
         end associate
      end if
      call load_at(run, instant, load)
   end subroutine load_at_end

   !> Distance within which an instant counts as the instant of the jump: the shortest step, or rounding.
   pure real(wp) function jump_tolerance(stepper, jump) result(distance)
      type(newmark_stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: jump

      distance = max(scale(stepper%step, -deepest_level), 8.0_wp*epsilon(jump)*jump)
   end function jump_tolerance

   !> Minimum number of halvings of the step so that it does not pass the next jump of a load.
   pure integer function level_to_jump(run, min_level) result(level)
      type(newmark_run_t), intent(in) :: run
      !> Number of halvings required for other reasons
      integer, intent(in) :: min_level

      level = min_level
      if (run%next_jump > size(run%jumps)) return
      associate (jump => run%jumps(run%next_jump))
         do while (level < deepest_level)
            if (instant_of(run, shiftr(whole_step, level)) <= jump + jump_tolerance(run%stepper, jump)) return
            level = level + 1
         end do
      end associate
   end function level_to_jump

   !> If the present state is at a jump, set its load to the load after the jump.
   pure subroutine pass_jump(run, has_passed)
      type(newmark_run_t), intent(inout) :: run
      !> Whether the state is at a jump
      logical, intent(out) :: has_passed

      ! instant of the last jump passed
      real(wp) :: last

      has_passed = .false.
      last = 0.0_wp
      do while (run%next_jump <= size(run%jumps))
         associate (jump => run%jumps(run%next_jump))
            if (instant_of(run) < jump - jump_tolerance(run%stepper, jump)) exit
            last = jump
         end associate
         has_passed = .true.
         run%next_jump = run%next_jump + 1
      end do
      if (.not. has_passed) return
      associate (state => run%states(run%now))
         state%load_tau = max(instant_of(run), last)
         call load_at(run, state%load_tau, state%beam%load)
      end associate
   end subroutine pass_jump

   !> Damping besides 2 zeta K: proportional to M, or modal damping, the sum of 2 xi_i W_i (M phi_i)(M phi_i)^T over the
   !> modes phi_i, with M-norm 1, of frequency W_i and damping ratio xi_i. That matrix is full, so the matrices of the
   !> supported beam are extended to the full profile. Damping rates of single degrees of freedom replace this damping.
   subroutine additional_damping(settings, model, supported, modes, damping, error)
      type(run_settings_t), intent(in) :: settings
      !> The beam before its rigid supports are fixed; the damping ratios are those of the modes that `find_free_modes`
      !> computes with the supports
      type(beam_model_t), intent(in) :: model
      !> The beam with its rigid supports fixed; modal damping extends its matrices to the full profile,
      !> unless its degrees of freedom are modes
      type(beam_model_t), intent(inout) :: supported
      !> The modes that are the degrees of freedom; unallocated: the degrees of freedom are those of the nodes
      type(free_modes_t), allocatable, intent(in) :: modes
      !> Damping besides 2 zeta K; unallocated: there is none
      type(skyline_t), allocatable, intent(out) :: damping
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      type(free_modes_t) :: damped
      ! M phi_i
      real(wp), allocatable :: force(:)
      integer :: column, i, row

      if (allocated(modes)) then
         allocate (damping, source=supported%mass)
         damping%values = modes%rate
      else if (allocated(settings%mode_ratios)) then
         ! `find_free_modes` needs the model before its rigid supports are fixed, because it attaches supports to the
         ! modes of the unsupported beam, whose mass matrix includes all degrees of freedom
         call find_free_modes(model, damped, error)
         if (allocated(error)) return
         damped%rate = rates_of_modes(settings, damped%square, damped%own_rate)
         supported%stiffness = full_profile(supported%stiffness)
         supported%mass = full_profile(supported%mass)
         allocate (damping, source=supported%mass)
         damping%values = 0.0_wp
         allocate (force(supported%mass%order), source=0.0_wp)
         do i = 1, size(damped%square)
            call multiply(supported%mass, damped%mode(:, i), force)
            do column = 1, damping%order
               do row = 1, column
                  associate (entry => damping%values(damping%diagonal(column) - column + row))
                     entry = entry + damped%rate(i)*force(row)*force(column)
                  end associate
               end do
            end do
         end do
      else if (settings%zeta_mass > 0.0_wp .or. allocated(model%own_rate)) then
         allocate (damping, source=supported%mass)
         damping%values = 2.0_wp*settings%zeta_mass*damping%values
         if (.not. allocated(model%own_rate)) return
         do i = 1, damping%order
            if (model%own_rate(i) < 0.0_wp) cycle
            associate (place => damping%diagonal(i))
               damping%values(place) = model%own_rate(i)*supported%mass%values(place) &
                  - 2.0_wp*settings%zeta*supported%stiffness%values(place)/lambda1_power4
            end associate
         end do
      end if
   end subroutine additional_damping

   !> The matrix stored with all entries of each column down to the diagonal, zeros included.
   pure type(skyline_t) function full_profile(matrix) result(full)
      type(skyline_t), intent(in) :: matrix

      integer :: column, i, row

      call make_skyline(full, [(1, i=1, matrix%order)])
      do column = 1, matrix%order
         do row = matrix%first_row(column), column
            full%values(full%diagonal(column) - column + row) = matrix%values(matrix%diagonal(column) - column + row)
         end do
      end do
   end function full_profile

end module newmark_loads
