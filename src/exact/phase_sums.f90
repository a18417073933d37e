!> Rows of a phase of exact motion (the motion between two events) as explicit sums of exponentials (docs/theory.md,
!> sections 20 and 24). Rows are linear functionals of the motion: displacements, contact forces, bending moments.
module phase_sums
   use certified_search, only: transformable_signal_t
   use driven_modes, only: driven_mode_t, make_driven_mode
   use driven_signal, only: driven_terms_t
   use exponential_sums, only: append_terms, exponential_sums_t, open_sums, value_of
   use history_list, only: acceleration_stop, acceleration_tip
   use kinds, only: wp
   use mode_terms, only: find_mode_terms, mode_terms_t, slow_exponents, slow_points
   use moment_signals, only: find_load_terms, find_row, moments_t, motion_row_t
   use phase_state, only: observed_gap, observed_tip, phase_state_t, signal_of
   use response_types, only: contact_record_t
   use run_recorder, only: sample_t
   implicit none (type, external)
   private
   public :: find_sums, find_acceleration, sample_accelerations

contains

   !> Find the sums of some rows of an interval. The numbers of rows are those of `find_row`.
   subroutine find_sums(now, moments, length, rows, sums, order)
      type(phase_state_t), intent(in) :: now
      type(moments_t), intent(in) :: moments
      !> Length of the phase, > 0
      real(wp), intent(in) :: length
      !> Numbers of the rows
      integer, intent(in) :: rows(:)
      type(exponential_sums_t), intent(out) :: sums
      !> Order of the time derivative of the rows: 0 (default), or 2 for displacements alone
      integer, intent(in), optional :: order

      type(motion_row_t) :: row(size(rows))
      ! terms of uncoupled modes: one less than the first, and the last
      integer :: modes(2)
      integer :: n

      call open_sums(size(rows), 0, sums)
      do n = 1, size(rows)
         call find_row(moments, rows(n), now, row(n))
      end do
      sums%power(0, :) = row%static
      if (size(now%set%compliant) > 0) then
         call add_coupled_terms(now, rows, row, sums)
         modes(1) = size(sums%exponent)
         call add_mode_terms(now, length, now%set%coupled%inactive, row, sums, order)
      else
         modes(1) = 0
         call add_mode_terms(now, length, [(n, n=1, now%set%constrained%count)], row, sums, order)
      end if
      modes(2) = size(sums%exponent)
      if (now%loads%count > 0) call add_load_response(now, rows, row, sums)
      call add_nodes(now, rows, sums)
      if (.not. present(order)) return
      ! the second derivatives of constants and slopes are zero, and `add_mode_terms` has differentiated the terms of
      ! its modes
      sums%power = 0.0_wp
      do n = 1, size(sums%exponent)
         if (n > modes(1) .and. n <= modes(2)) cycle
         sums%amplitude(:, n) = sums%exponent(n)**order*sums%amplitude(:, n)
      end do
   end subroutine find_sums

   !> Add the exponential terms of the motion with compliant contacts.
   subroutine add_coupled_terms(now, rows, row, sums)
      type(phase_state_t), intent(in) :: now
      !> Numbers of the rows
      integer, intent(in) :: rows(:)
      !> Coefficients of the rows
      type(motion_row_t), intent(in) :: row(:)
      type(exponential_sums_t), intent(inout) :: sums

      integer :: i, m

      call append_terms(now%set%coupled%exponent, sums)
      associate (set => now%set, coupled => now%set%coupled)
         do i = 1, size(rows)
            sums%power(0, i) = sums%power(0, i) + sum(row(i)%weight*set%rest_modes) &
               + sum(row(i)%force_moment*set%rest_force)
            if (rows(i) <= size(now%states)) then
               ! gaps of closed contacts are indentations, without the rounding errors of a sum over the modes
               sums%amplitude(i, :) = set%gap(rows(i), :)*now%amplitude
               cycle
            end if
            do m = 1, coupled%count
               sums%amplitude(i, m) = now%amplitude(m)*(merge(coupled%viscous(m), (1.0_wp, 0.0_wp), &
                  row(i)%is_viscous)*sum(row(i)%weight*coupled%shape(:, m)) &
                  + sum(row(i)%force_moment*coupled%force(:, m)))
            end do
         end do
      end associate
   end subroutine add_coupled_terms

   !> Add the free vibrations of uncoupled modes, and the responses of these modes to loads that drive them from rest.
   subroutine add_mode_terms(now, length, modes, row, sums, order)
      type(phase_state_t), intent(in) :: now
      !> Length of the phase
      real(wp), intent(in) :: length
      !> Indices of the uncoupled modes
      integer, intent(in) :: modes(:)
      !> Coefficients of the rows
      type(motion_row_t), intent(in) :: row(:)
      type(exponential_sums_t), intent(inout) :: sums
      !> Order of the time derivative, as in `find_sums`
      integer, intent(in), optional :: order

      type(driven_mode_t), allocatable :: driven(:)
      type(mode_terms_t) :: terms(size(modes))
      ! displacement and velocity of a mode at the start of the phase, or their second derivatives
      real(wp) :: start(2)
      ! rows per unit of the displacement of a mode, and per unit of displacement + 2 zeta velocity
      real(wp) :: weight(size(row), 2)
      ! number of terms so far
      integer :: last
      ! number of exponents around 0 that all slow modes have in common
      integer :: shared
      integer :: i, j

      if (size(modes) == 0) return
      do j = 1, size(modes)
         start = [now%z(modes(j)), now%v(modes(j))]
         driven = forced_motions_of(now, modes(j))
         if (present(order)) call derive_twice(make_driven_mode(now%set%constrained%oscillators, modes(j)), start, &
            driven)
         call find_mode_terms(now%set%constrained%oscillators, modes(j), start, driven, length, terms(j))
      end do
      last = size(sums%exponent)
      shared = 0
      if (any([(any(abs(terms(j)%slow) > 0.0_wp), j=1, size(modes))])) shared = slow_points
      call append_terms([slow_exponents(length, shared), (terms(j)%exponent, j=1, size(modes))], sums)
      associate (slow => sums%amplitude(:, last + 1:last + shared))
         last = last + shared
         do j = 1, size(modes)
            weight = 0.0_wp
            do i = 1, size(row)
               weight(i, merge(2, 1, row(i)%is_viscous)) = row(i)%weight(modes(j))
            end do
            sums%power(0, :) = sums%power(0, :) + matmul(weight, terms(j)%offset)
            sums%power(1, :) = sums%power(1, :) + matmul(weight, terms(j)%slope)
            slow = slow + matmul(weight, terms(j)%slow(:, :shared))
            associate (added => size(terms(j)%exponent))
               sums%amplitude(:, last + 1:last + added) = matmul(weight, terms(j)%amplitude)
               last = last + added
            end associate
         end do
      end associate
   end subroutine add_mode_terms

   !> Replace a mode by its acceleration. The acceleration obeys the equation of motion of the mode, with the second
   !> derivatives of the loads. The terms of the motion are not differentiated: in a short phase their exponents are
   !> points of a circle with a large radius, whose square would amplify rounding errors.
   pure subroutine derive_twice(mode, start, driven)
      !> The mode, with its coefficients
      type(driven_mode_t), intent(in) :: mode
      !> On entry displacement and velocity at the start, without loads; on return their second derivatives, with loads
      real(wp), intent(inout) :: start(2)
      !> Motions driven from rest by loads
      type(driven_mode_t), intent(inout) :: driven(:)

      ! second derivatives of displacement and velocity
      real(wp) :: acceleration, jerk

      associate (force => driven%force, frequency => driven%frequency)
         acceleration = sum(real(force, wp), mask=.not. driven%is_ramp) - mode%square*start(1) - mode%damping*start(2)
         jerk = sum(merge(real(force, wp), -frequency*aimag(force), driven%is_ramp)) - mode%square*start(2) &
            - mode%damping*acceleration
         start = [acceleration, jerk]
         ! the second derivatives of constants and ramps are zero
         driven%force = -frequency**2*force
      end associate
   end subroutine derive_twice

   !> Responses of one mode to loads that drive it from rest.
   pure function forced_motions_of(now, mode) result(driven_motions)
      type(phase_state_t), intent(in) :: now
      integer, intent(in) :: mode
      type(driven_mode_t), allocatable :: driven_motions(:)

      integer :: k

      allocate (driven_motions(0))
      if (now%loads%count == 0) return
      associate (driven => now%set%forced%driven, forced => now%forced)
         driven_motions = pack(forced%mode, [(driven(forced%pair(k))%mode == mode, k=1, size(forced%pair))])
      end associate
   end function forced_motions_of

   !> Add the load response without the modes that are driven from rest.
   subroutine add_load_response(now, rows, row, sums)
      type(phase_state_t), intent(in) :: now
      !> Numbers of the rows
      integer, intent(in) :: rows(:)
      !> Coefficients of the rows
      type(motion_row_t), intent(in) :: row(:)
      type(exponential_sums_t), intent(inout) :: sums

      type(driven_terms_t) :: terms
      integer :: i, last

      last = size(sums%exponent)
      call append_terms(cmplx(0.0_wp, now%forced%frequency, wp), sums)
      associate (at => now%set%forced%at, forced => now%forced, n => size(now%states))
         do i = 1, size(rows)
            if (rows(i) > 2*n + 1) then
               call find_load_terms(now, row(i), terms)
            else
               ! the load response of displacements of the beam and of contact forces is known
               associate (place => merge(at%gaps, merge(at%tip - n, at%forces - (n + 1), rows(i) == n + 1), &
                  rows(i) <= n) + rows(i))
                  terms%constant = forced%constant(place)
                  terms%slope = forced%slope(place)
                  terms%harmonic = forced%harmonic(place, :)
               end associate
            end if
            sums%power(0, i) = sums%power(0, i) + terms%constant
            sums%power(1, i) = sums%power(1, i) + terms%slope
            sums%amplitude(i, last + 1:) = terms%harmonic
         end do
      end associate
   end subroutine add_load_response

   !> The acceleration at a contact, in the direction of its gap, or of the tip as a signal, valid until the next call.
   subroutine find_acceleration(now, row, signal)
      type(phase_state_t), target, intent(inout) :: now
      !> Number of the row: a contact, or the number of contacts + 1 for the tip
      integer, intent(in) :: row
      class(transformable_signal_t), pointer, intent(out) :: signal

      class(transformable_signal_t), allocatable :: acceleration, rate
      real(wp) :: factor
      ! index of the contact; at the tip, of a massless node that is the tip, or 0
      integer :: k

      k = row
      factor = 1.0_wp
      if (row > size(now%states)) then
         k = findloc(now%states%is_node .and. abs(now%beam%tip_sign) > 0.0_wp, .true., dim=1)
         ! a node on its stop does not move
         if (k > 0) factor = merge(0.0_wp, now%beam%tip_sign(k), now%set%is_closed(k))
      end if
      call signal_of(now, k, merge(observed_tip, observed_gap, k == 0), signal)
      call signal%transform(0.0_wp, factor, 0.0_wp, 1, rate)
      call rate%transform(0.0_wp, 1.0_wp, 0.0_wp, 1, acceleration)
      call move_alloc(acceleration, now%signal)
      signal => now%signal
   end subroutine find_acceleration

   !> Accelerations of the beam at a sample, positive upwards; impulses are not part of them. The histories of the run
   !> refer to the release contact or, without a stop, to the tip.
   subroutine sample_accelerations(now, moments, length, time, place, sums, records, sample)
      type(phase_state_t), intent(in) :: now
      type(moments_t), intent(in) :: moments
      !> Length of the phase
      real(wp), intent(in) :: length
      !> Time since the start of the phase
      real(wp), intent(in) :: time
      !> Index of the sample in the histories of contacts
      integer, intent(in) :: place
      !> Accelerations in the phase; unallocated: not found yet
      type(exponential_sums_t), allocatable, intent(inout) :: sums
      type(contact_record_t), intent(inout) :: records(:)
      type(sample_t), intent(inout) :: sample

      ! accelerations at the contacts and at the tip, [contacts + 1]
      real(wp) :: values(size(now%states) + 1)
      integer :: k

      if (.not. allocated(sums)) then
         allocate (sums)
         call find_sums(now, moments, max(length, tiny(1.0_wp)), [(k, k=1, size(values))], sums, order=2)
         ! from the direction of a gap to upwards
         do k = 1, size(now%states)
            if (now%states(k)%contact%sign > 0.0_wp) cycle
            sums%power(:, k) = -sums%power(:, k)
            sums%amplitude(k, :) = -sums%amplitude(k, :)
         end do
      end if
      values = value_of(sums, time)
      associate (n => size(now%states), release => now%release_contact)
         sample%history(acceleration_tip) = values(n + 1)
         sample%history(acceleration_stop) = values(merge(n + 1, release, release == 0))
         do k = 1, n
            if (allocated(records(k)%acceleration)) records(k)%acceleration(place) = values(k)
         end do
      end associate
   end subroutine sample_accelerations

   !> Add the displacement of massless nodes at rigid stops relative to the modes. A node on its stop does not move. A
   !> node away from its stop carries no force, so its displacement relative to the modes decays exponentially by the
   !> damping of the elements beside it. The displacement at the start of the phase is `node_depth`, because the
   !> `indentation` of the contact is already that at the end of the phase.
   pure subroutine add_nodes(now, rows, sums)
      type(phase_state_t), intent(in) :: now
      !> Numbers of the rows
      integer, intent(in) :: rows(:)
      type(exponential_sums_t), intent(inout) :: sums

      real(wp) :: sign
      integer :: i, k

      do k = 1, size(now%states)
         associate (state => now%states(k))
            if (.not. state%is_node) cycle
            call append_terms([cmplx(merge(-state%spring%recovery_rate, 0.0_wp, state%spring%recovery_rate < &
               huge(1.0_wp)), 0.0_wp, wp)], sums)
            do i = 1, size(rows)
               ! factor of the node's displacement in the row, not zero for contacts at the node (`colocated`) and for
               ! the tip if the node is at the tip
               sign = 0.0_wp
               if (rows(i) <= size(now%states)) then
                  if (now%colocated(rows(i)) == now%colocated(k)) sign = now%colocated_sign(rows(i)) &
                     *now%colocated_sign(k)
               else if (rows(i) == size(now%states) + 1) then
                  sign = now%beam%tip_sign(k)
               end if
               if (.not. abs(sign) > 0.0_wp) cycle
               if (now%set%is_closed(k)) then
                  sums%power(:, i) = [sign*now%beam%height(k), 0.0_wp, 0.0_wp, 0.0_wp]
                  sums%amplitude(i, :) = (0.0_wp, 0.0_wp)
               else if (state%spring%recovery_rate < huge(1.0_wp)) then
                  sums%amplitude(i, size(sums%exponent)) = cmplx(sign*now%node_depth, 0.0_wp, wp)
               end if
            end do
         end associate
      end do
   end subroutine add_nodes

end module phase_sums
